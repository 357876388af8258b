//! Line that the clients of several feet use in turn.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use super::{Arrival, Arrived, LineClock, Link, LinkError, Sending};

/// One user of a line. What one user receives, the others do not.
#[derive(Clone)]
pub(crate) struct SharedLine {
    link: Rc<RefCell<Box<dyn Link>>>,
    /// The serial port that this user sees; `None` for all.
    port: Option<Arc<str>>,
}

impl SharedLine {
    pub(crate) fn new(link: Box<dyn Link>) -> Self {
        Self { link: Rc::new(RefCell::new(link)), port: None }
    }

    /// Returns the same line with nothing but this serial port, as a demo has several.
    pub(crate) fn of_port(&self, port: Arc<str>) -> Self {
        Self { port: Some(port), ..self.clone() }
    }
}

impl Link for SharedLine {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let arrived = self.link.borrow_mut().receive(longest)?;
        let is_own = |arrival: &Arrival| match (arrival, &self.port) {
            (Arrival::Bytes { port, .. }, Some(own)) => port == own,
            _ => true,
        };
        Ok(arrived.filter(|(_, arrival)| is_own(arrival)))
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        let mut link = self.link.borrow_mut();
        match (sending, &self.port) {
            (Sending::Bytes { bytes, .. }, Some(own)) => {
                let port = Some(Arc::clone(own));
                link.send(&Sending::Bytes { port, bytes: bytes.clone() })
            }
            _ => link.send(sending),
        }
    }

    fn park(&mut self) -> Result<(), LinkError> {
        self.link.borrow_mut().park()
    }

    fn clock(&self) -> LineClock {
        self.link.borrow().clock()
    }
}
