//! The contacts of a robot's four feet on one bus, with its controller, while one of them is updated.

use gait::GaitName;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::part::can::BusFrame;
use virtual_board::emulator::time::PER_SECOND;
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::serve::BoardPrograms;
use virtual_board::product::serve::robot::{BoardRobot, ControlNode, RobotOptions};

use super::master::{CLEAR, INSTALLED_MS, START, STOP, bootloader, new_image, segment};
use crate::common::product;

const BIT_RATE: u32 = 1_000_000;

/// Longest time between two contacts of a foot that is not updated, ms. It sends one each millisecond. The contact may wait
/// for frames on the bus, and the model delays the frames of other boards by a millisecond.
const LONGEST_GAP_MS: f64 = 3.0;

/// Longest time without contacts of the foot that is updated, ms, measured with a typical chip: two erases before the
/// image and for the install, its transfer, and its start.
const LONGEST_SILENCE_MS: f64 = 12_000.0;

/// Segments that the master sends in a millisecond. A chip sends the frame with the lowest identifier first. The model of the
/// bus sends the frames of a node in order, so a heartbeat that waits for a whole block would delay contacts.
const SEGMENTS_PER_MS: usize = 3;

/// Contacts of a foot.
struct Contacts {
    node: u8,
    count: u32,
    last_ms: f64,
    longest_gap_ms: f64,
}

/// A master on the bus of a robot, which watches the contacts.
struct Bench {
    robot: BoardRobot,
    feet: Vec<Contacts>,
    /// Answers to the master, and boot-up messages.
    received: Vec<BusFrame>,
    target: u8,
}

impl Bench {
    fn run(&mut self, ms: u32) {
        for _ in 0..ms {
            let happened = self.robot.step().unwrap_or_else(|error| panic!("{error}"));
            for carried in happened.carried {
                let frame = carried.frame;
                let at_ms = carried.start as f64 * 1000.0 / PER_SECOND as f64;
                let of = |foot: &&mut Contacts| frame.id == 0x180 + u32::from(foot.node);
                if let Some(foot) = self.feet.iter_mut().find(of) {
                    if foot.count > 0 {
                        foot.longest_gap_ms = foot.longest_gap_ms.max(at_ms - foot.last_ms);
                    }
                    foot.count += 1;
                    foot.last_ms = at_ms;
                }
                let target = u32::from(self.target);
                if [0x580 + target, 0x700 + target].contains(&frame.id) {
                    self.received.push(frame);
                }
            }
        }
    }

    fn send(&mut self, frame: BusFrame) {
        self.robot.send(frame, BIT_RATE);
    }

    fn push(&mut self, request: &[u8; 8]) {
        self.send(BusFrame::new(0x600 + u16::from(self.target), request));
    }

    /// Waits for a frame with this identifier.
    fn wait(&mut self, id: u32, ms: u32) -> BusFrame {
        for _ in 0..ms {
            self.run(1);
            let found = self.received.iter().position(|frame| frame.id == id);
            if let Some(at) = found {
                return self.received.swap_remove(at);
            }
        }
        panic!("no frame {id:#x} within {ms} ms");
    }

    fn answer(&mut self, ms: u32) -> Vec<u8> {
        let id = 0x580 + u32::from(self.target);
        self.wait(id, ms).data.as_slice().into()
    }

    fn control(&mut self, command: u8, ms: u32) {
        self.received.clear();
        self.push(&[0x2F, 0x51, 0x1F, 1, command, 0, 0, 0]);
        assert_eq!(self.answer(ms)[0], 0x60, "{command}");
    }

    fn nmt(&mut self, command: u8) {
        self.send(BusFrame::new(0, &[command, self.target]));
        self.run(5);
    }

    fn download(&mut self, image: &[u8]) {
        let [a, b, c, d] = (image.len() as u32).to_le_bytes();
        self.push(&[0xC2, 0x50, 0x1F, 1, a, b, c, d]);
        let size = usize::from(self.answer(100)[4]);
        let segments: Vec<&[u8]> = image.chunks(7).collect();
        for (block, first) in segments.chunks(size).zip((0..).step_by(size)) {
            for (k, bytes) in block.iter().enumerate() {
                let is_last = first + k + 1 == segments.len();
                self.push(&segment(k as u8 + 1, bytes, is_last));
                if (k + 1) % SEGMENTS_PER_MS == 0 {
                    self.run(1);
                }
            }
            let answer = self.answer(500);
            assert_eq!((answer[0], usize::from(answer[1])), (0xA2, block.len()));
        }
        let unused = 7 - segments.last().map_or(7, |bytes| bytes.len()) as u8;
        self.push(&[0xC1 | unused << 2, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(self.answer(1_000)[0], 0xA1);
    }
}

#[test]
#[ignore = "full: four feet, of which one is updated"]
fn other_feet_stream_each_contact_while_one_is_updated() {
    let elf = product();
    let programs = BoardPrograms {
        program: elf.clone().into(),
        bootloader: Some(bootloader(Wiring::reference()).into()),
    };
    let options = RobotOptions {
        feet: 4,
        gait: GaitName::Walk,
        seed: 1,
        corner: Corner::Typical,
        control: ControlNode::Present,
        settings: Vec::new(),
    };
    let mut robot = BoardRobot::start(programs, &options).unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..1_000 {
        robot.step().unwrap_or_else(|error| panic!("{error}"));
    }
    let nodes = robot.positions().map(|foot| foot.default_node_id().get());
    let feet = nodes.map(|node| Contacts { node, count: 0, last_ms: 0.0, longest_gap_ms: 0.0 });
    let feet: Vec<Contacts> = feet.collect();
    let target = feet[0].node;
    let mut bench = Bench { robot, feet, received: Vec::new(), target };
    let begin = bench.robot.ms;
    bench.run(500);
    bench.nmt(0x80);
    bench.control(STOP, 1_000);
    bench.control(CLEAR, 5_000);
    bench.download(&new_image(&elf));
    bench.control(START, 100);
    bench.wait(0x700 + u32::from(target), INSTALLED_MS);
    bench.nmt(0x01);
    bench.run(500);
    let passed = (bench.robot.ms - begin) as u32;
    let [updated, others @ ..] = &bench.feet[..] else {
        panic!("no feet");
    };
    for foot in others {
        let (node, gap) = (foot.node, foot.longest_gap_ms);
        assert!(gap < LONGEST_GAP_MS, "node {node}: {gap} ms");
        // The last frames still wait for the bus.
        assert!(foot.count + 5 >= passed, "{} in {passed} ms", foot.count);
    }
    let silence = updated.longest_gap_ms;
    assert!((1_000.0..LONGEST_SILENCE_MS).contains(&silence), "{silence} ms");
    assert_eq!(bench.robot.bus.lost, 0);
}
