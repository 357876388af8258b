//! t
use virtual_board::{chip::Chip, core::cpu::Cpu, elf::Image, machine::Machine, time};
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let image = Image::parse(&std::fs::read(path).unwrap()).unwrap();
    let mut cpu = Cpu::new(Machine::new(Chip::default()), &image.segments).unwrap();
    let t = std::time::Instant::now();
    let r = cpu.run_until(100 * time::PER_SECOND);
    let el = t.elapsed();
    let m = cpu.machine();
    println!("{r:?} {:?}", m.semihosting.exit);
    print!("{}", String::from_utf8_lossy(&m.semihosting.output));
    println!("{:?} in {el:?}, faults {:?}", m.counters(), m.faults);
}
