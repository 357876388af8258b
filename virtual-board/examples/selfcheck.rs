//! t
use virtual_board::{board::Board, time};
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let ms: u64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let mut board = Board::from_elf(&std::fs::read(path).unwrap()).unwrap();
    if std::env::var_os("PROFILE").is_some() { board.run_for(time::PER_SECOND).unwrap(); board.start_profile(); }
    let t = std::time::Instant::now();
    let r = board.run_for(ms * time::PER_SECOND / 1000);
    let el = t.elapsed();
    println!("{r:?} state {:?} pc {:#x} {:?}", board.state(), board.register(15), board.function());
    println!("{:?} in {el:?}", board.counters());
    println!("faults {:?} resets {:?}", board.faults().iter().take(3).collect::<Vec<_>>(), board.resets());
    println!("exceptions {:?}", board.exceptions());
    for (name, count) in board.profile().iter().take(25) { println!("{count:10} {name}"); }
    let uart = board.take_uart();
    println!("uart {} bytes", uart.len());
    let can = board.take_can();
    println!("can {} frames {:x?}", can.len(), can.iter().take(4).collect::<Vec<_>>());
    println!("offences {:?}", board.cpu().machine().chip.sensor.as_ref().map(|s| s.offences().to_vec()));
    println!("errors {:?}", board.cpu().machine().chip.can.errors());
}
