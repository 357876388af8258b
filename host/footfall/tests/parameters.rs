//! Tests that another participant can list the parameters of a node but not set them.

use std::net::{IpAddr, Ipv4Addr};
use std::thread;
use std::time::Duration;

use crate::domain::Domain;
use footfall::ros::node::{FootNode, FootNodeOptions, Reliability};
use futures::executor::block_on;
use ros2_client::parameters::raw;
use ros2_client::qos::History;
use ros2_client::rcl_interfaces::{
    ListParametersRequest, ListParametersResponse, SetParametersRequest, SetParametersResponse,
};
use ros2_client::{
    Context, ContextOptions, Message, Name, Node, NodeName, NodeOptions, Parameter, ParameterValue,
    QosProfile, ServiceMapping, ServiceTypeName,
};

/// Requests after which a service that does not answer ends the test as hung.
const REQUESTS: u32 = 600;

fn options(domain_id: u16) -> FootNodeOptions {
    FootNodeOptions {
        domain_id,
        networks: vec![IpAddr::V4(Ipv4Addr::LOCALHOST)],
        namespace: "/robot".to_owned(),
        name: "feet".to_owned(),
        reliability: Reliability::Reliable,
        depth: 10,
        source: "demo:feet=4".to_owned(),
        frame_id: "{foot}_foot".to_owned(),
        compat: Vec::new(),
    }
}

/// Calls a service of the node until it answers: what is sent before both participants have found
/// each other's readers is lost. Answers to requests of an earlier client are skipped.
fn ask<Req, Resp>(node: &mut Node, service: &str, kind: &str, request: &Req) -> Resp
where
    Req: Message + Clone + 'static,
    Resp: Message + Clone + 'static,
{
    let qos = QosProfile::publisher_default().history(History::KeepLast { depth: 1 });
    let name = Name::new("/robot/feet", service).expect("a name");
    let kind = ServiceTypeName::new("rcl_interfaces", kind);
    let client = node
        .create_client::<Req, Resp>(ServiceMapping::Enhanced, &name, &kind, qos.clone(), qos)
        .expect("a client");
    let mut sent = Vec::new();
    for _ in 0..REQUESTS {
        sent.push(client.send_request(request.clone()).expect("it is sent"));
        for _ in 0..20 {
            thread::sleep(Duration::from_millis(50));
            if let Some((id, response)) = client.receive_response().expect("a response")
                && sent.contains(&id)
            {
                return response;
            }
        }
    }
    panic!("{service} has not answered {REQUESTS} requests, one a second");
}

#[test]
fn parameters_are_listed_and_read_only() {
    let domain = Domain::take();
    let feet = FootNode::new(options(domain.id)).expect("a node");
    let context = Context::with_options(ContextOptions::new().domain_id(domain.id));
    let name = NodeName::new("/", "asks").expect("a name");
    let node = context.expect("a context").new_node(name, NodeOptions::new());
    let mut node = node.expect("a node");
    let spinner = node.spinner().expect("a spinner");
    thread::spawn(|| block_on(spinner.spin()));
    let request = ListParametersRequest { prefixes: Vec::new(), depth: 0 };
    let listed: ListParametersResponse =
        ask(&mut node, "list_parameters", "ListParameters", &request);
    let set = |value: &str| SetParametersRequest {
        parameter: vec![raw::Parameter::from(Parameter {
            name: "frame_id".to_owned(),
            value: ParameterValue::String(value.to_owned()),
        })],
    };
    let mut results = Vec::new();
    for value in ["{foot}_foot", "other"] {
        let answer: SetParametersResponse =
            ask(&mut node, "set_parameters", "SetParameters", &set(value));
        results.extend(answer.results);
    }
    let expected = ["compat", "frame_id", "qos.depth", "qos.reliability", "source", "use_sim_time"];
    assert_eq!(listed.result.names, expected);
    let successful: Vec<_> = results.iter().map(|result| result.successful).collect();
    assert_eq!(successful, [true, false], "{results:?}");
    assert!(results[1].reason.contains("read-only"), "{results:?}");
    feet.finish();
}
