//! The states of a Unitree robot, published again as they come. The contacts replace the forces of the feet, whereas joint
//! angles, battery and all other fields are kept.

use std::convert::Infallible;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::Waker;
use std::thread;
use std::time::{Duration, Instant};

use bags::{Replacement, ReplacementError};
use rustdds::no_key::{DataWriter, SerializerAdapter};
use rustdds::{DomainParticipant, QosPolicies, RepresentationIdentifier, TopicKind};

use crate::messages::{detail, warn};
use crate::ros::domain::NodeError;
use crate::ros::subscriber::{AnyMessage, FoundTopic, Message, Signal, subscribe_if_found};

/// Topic on which the robot publishes its states.
const LOW_STATE: &str = "/lowstate";

/// Names of the forces, in Unitree's order of feet.
const FORCES: [&str; 8] = [
    "foot_force[0]",
    "foot_force[1]",
    "foot_force[2]",
    "foot_force[3]",
    "foot_force_est[0]",
    "foot_force_est[1]",
    "foot_force_est[2]",
    "foot_force_est[3]",
];

/// Time between looks for the robot.
const LOOKS: Duration = Duration::from_millis(200);

/// Time to wait for the robot's states. After that, messages are published that have nothing but forces.
const WAITED_FOR: Duration = Duration::from_secs(2);

/// Longest wait for a message.
const LISTEN: Duration = Duration::from_millis(50);

/// Messages are written as they are.
impl SerializerAdapter<Message> for AnyMessage {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(message: &Message) -> Result<rustdds::bytes::Bytes, Infallible> {
        // The writer adds the encoding.
        Ok(rustdds::bytes::Bytes::copy_from_slice(message.get(4..).unwrap_or_default()))
    }
}

/// Merger of the states of a robot with the contacts of its feet.
pub(super) struct LowStateMerger {
    shared: Arc<Shared>,
    began: Instant,
}

#[derive(Default)]
struct Shared {
    /// Newest forces, in Unitree's order of feet; `None` before all feet have sent a contact.
    forces: Mutex<Option<[i16; 4]>>,
    /// Whether the robot was found.
    is_found: AtomicBool,
    is_over: AtomicBool,
}

impl LowStateMerger {
    /// Begins to look for the robot. Merged states are published on the topic with this name in DDS.
    ///
    /// # Errors
    /// No thread can be created.
    pub(super) fn start(
        participant: DomainParticipant,
        dds_topic: String,
        qos: QosPolicies,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let thread = thread::Builder::new().name("lowstate".to_owned());
        let own = Arc::clone(&shared);
        thread.spawn(move || {
            if let Err(error) = merge(&participant, &dds_topic, &qos, &own) {
                warn(format!("{LOW_STATE} cannot be merged: {error}"));
                own.is_found.store(false, Ordering::Relaxed);
            }
        })?;
        Ok(Self { shared, began: Instant::now() })
    }

    /// Sets the newest forces. Returns true if the robot publishes states, or may still begin to. The caller must then
    /// publish no state of its own.
    pub(super) fn set(&self, forces: [i16; 4]) -> bool {
        *self.shared.forces.lock().unwrap_or_else(PoisonError::into_inner) = Some(forces);
        self.shared.is_found.load(Ordering::Relaxed) || self.began.elapsed() < WAITED_FOR
    }
}

impl Drop for LowStateMerger {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
    }
}

/// Error that ends the merging.
#[derive(Debug, thiserror::Error)]
enum MergeError {
    #[error(transparent)]
    Node(#[from] NodeError),
    #[error(transparent)]
    Replacement(#[from] ReplacementError),
    #[error("{0}")]
    Create(String),
}

fn merge(
    participant: &DomainParticipant,
    dds_topic: &str,
    qos: &QosPolicies,
    shared: &Shared,
) -> Result<(), MergeError> {
    let create = |error: rustdds::dds::CreateError| MergeError::Create(error.to_string());
    let subscriber = participant.create_subscriber(qos).map_err(create)?;
    let FoundTopic { reader, channel, dds_type, .. } = loop {
        if shared.is_over.load(Ordering::Relaxed) {
            return Ok(());
        }
        match subscribe_if_found(participant, &subscriber, LOW_STATE)? {
            Some(found) => break found,
            None => thread::sleep(LOOKS),
        }
    };
    let replacement = Replacement::of(&channel, &FORCES)?;
    let publisher = participant.create_publisher(qos).map_err(create)?;
    let topic = participant
        .create_topic(dds_topic.to_owned(), dds_type, qos, TopicKind::NoKey)
        .map_err(create)?;
    let writer: DataWriter<Message, AnyMessage> =
        publisher.create_datawriter_no_key(&topic, Some(qos.clone())).map_err(create)?;
    shared.is_found.store(true, Ordering::Relaxed);
    detail(format!("{LOW_STATE} is published again with the contacts of the feet as its forces"));
    let signal = Arc::new(Signal::default());
    let waker = Waker::from(Arc::clone(&signal));
    while !shared.is_over.load(Ordering::Relaxed) {
        reader.set_waker(Some(waker.clone()));
        reader.drain_read_notifications();
        while let Ok(Some(change)) = reader.try_take_one() {
            let forces = *shared.forces.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(forces) = forces else { continue };
            let forces = [forces, forces].concat();
            let values: Vec<f64> = forces.into_iter().map(f64::from).collect();
            let message = replacement.replaced(&change.into_value(), &values)?;
            // A subscriber that does not keep up loses states, as it loses the robot's own states.
            let _ = writer.write(message, Some(rustdds::Timestamp::now()));
        }
        signal.wait(LISTEN);
    }
    Ok(())
}
