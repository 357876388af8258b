// The RP2040: what rp2040js 1.4.1 lacks, or has otherwise than embassy-rp needs it.

import { BasePeripheral, RP2040 } from 'rp2040js';
import { speedUp } from './core.mjs';
import { FlashChip } from './flash.mjs';
import { I2c } from './i2c.mjs';
import { image, loadSecondStage, trap } from './rom.mjs';

const RAM = 0x20000000;
const RAM_SIZE = 0x42000;
const FLASH = 0x10000000;
const ROM_SIZE = 0x4000;
const AIRCR = 0xd0c;
const SYSRESETREQ = 0x05fa0004;
const HARD_FAULT = 3;
const I2C0_IRQ = 23;
const RESET_I2C0 = 1 << 3;
const RESET_USB = 1 << 24;

// Of the SSI.
const CTRLR0 = 0x00;
const CTRLR1 = 0x04;
const SSIENR = 0x08;
const DR0 = 0x60;
const SPI_CTRLR0 = 0xf4;
const INST_L = 0x300;

// Of the ring oscillator, typical, from which all runs until the program sets the clocks.
const RING_HZ = 6.5e6;
// A line of the XIP cache: an address, four wait cycles and eight bytes over four wires, at a quarter of the clock.
const LINE = 8;
const LINE_CYCLES = 4 * (8 + 4 + 16);

// CHIP_RESET: the cause of the last reset of the whole chip, which one by the watchdog is not.
const CHIP_RESET = { power: 1 << 8, run: 1 << 16 };

// embassy-rp writes zeros to all registers of USB, the hold time of I2C's SDA, and what wakes a dormant chip: to no
// effect here.
const UNSUNG = ['USB', 'I2C0', 'IO_BANK0_BASE'];

/** Registers that keep the written value. A read of some registers returns another value. */
class Registers extends BasePeripheral {
  constructor(chip, name, initial = {}, reads = {}) {
    super(chip, name);
    this.values = { ...initial };
    this.reads = reads;
  }

  readUint32(offset) {
    return this.reads[offset] ? this.reads[offset]() : (this.values[offset] ?? 0);
  }

  writeUint32(offset, value) {
    this.values[offset] = value >>> 0;
  }
}

/** Commands to the flash chip, as the second boot stage and `embassy_rp::flash` send them one by one. */
class Ssi extends Registers {
  constructor(chip, name, flashChip) {
    super(chip, name, {}, { 0x28: () => 0x6 | (this.answers.length ? 0x8 : 0), 0x60: () => this.answers.shift() ?? 0 });
    this.flashChip = flashChip;
    this.answers = [];
    this.sent = 0;
  }

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    if (offset === SSIENR) [this.answers, this.sent] = [[], 0];
    const isRead = ((this.values[CTRLR0] >> 8) & 3) === 3;
    const isCommandSent = (this.values[SPI_CTRLR0] & INST_L) !== 0;
    if (offset === SSIENR && value && isRead && !isCommandSent) this.flashChip.map(this.values[SPI_CTRLR0] >>> 24);
    if (offset !== DR0) return;
    // A command has ended when all its answers have been read.
    if (!this.answers.length) this.sent = 0;
    if (this.sent === 0) [this.command, this.reply] = [value & 0xff, this.flashChip.answer(value & 0xff)];
    if (isRead) {
      if (this.sent) this.flashChip.start(this.command, value & 0xff);
      // As many bytes as the controller clocks. After the chip's last one its output floats.
      const length = (this.values[CTRLR1] ?? 0) + 1;
      this.answers = Array.from({ length }, (_, at) => this.reply[at] ?? this.flashChip.floating());
    } else this.answers.push(this.sent ? (this.reply[this.sent - 1] ?? this.flashChip.floating()) : 0);
    this.sent += 1;
  }
}

export class Chip extends RP2040 {
  /**
   * Starts the program in `flash`, whose chip is of a kind, after a reset by the watchdog, by `power` or by the pin `run`.
   * `before` is the chip until then: RAM keeps its contents. After a watchdog reset the watchdog's registers do so too.
   */
  constructor(clock, { flash, flashKind, uniqueId, wires, before, cause }) {
    super(clock);
    const warn = (component, message) => UNSUNG.includes(component) || this.onWarning(`${component}: ${message}`);
    this.logger = {
      debug: () => {},
      warn,
      error: warn,
      // rp2040js logs SEV and does nothing; a thread-mode executor would sleep on work.
      info: (component, message) => {
        if (message === 'SEV') this.core.eventRegistered = true;
      },
    };
    this.onWarning = this.onReset = this.onUsbBoot = this.onUsbReset = () => {};
    this.flash = flash;
    this.flash16 = new Uint16Array(flash.buffer);
    this.flashView = new DataView(flash.buffer);
    this.flashLog = before?.flashLog ?? { erased: 0, programmed: 0 };
    this.bootrom.set(image());
    this.isBootselPressed = false;
    this.stalledNs = 0;
    this.cycleNs = 1e9 / RING_HZ;
    this.addClockListener((hertz) => (this.cycleNs = 1e9 / hertz));
    this.flashChip = new FlashChip(flashKind, uniqueId);
    this.chipReset = CHIP_RESET[cause] ?? before.chipReset;
    this.addPeripherals(wires);
    this.keepWatchdog(cause === 'watchdog' ? before : undefined);
    this.startTimer(clock);
    this.allowSystemReset();
    this.onBreak = () => this.core.exceptionEntry(HARD_FAULT);
    if (before && cause !== 'power') this.sram.set(before.sram);
    this.isDead = !loadSecondStage(this);
    speedUp(this.core, this);
  }

  addPeripherals(wires) {
    let random = 1;
    const randomBit = () => (random = Math.imul(random, 1103515245) + 12345) >>> 31;
    const chipSelect = () => (this.isBootselPressed ? 0 : 0xa0000);
    const voltage = () => (this.peripherals[0x40064].values[0] | 0x1000) >>> 0;
    this.i2c[0] = new I2c(this, 'I2C0', I2C0_IRQ, wires);
    Object.assign(this.peripherals, {
      0x14000: new Registers(this, 'XIP_CTRL', {}, { 0x8: () => 3 }),
      0x18000: new Ssi(this, 'SSI', this.flashChip),
      0x40018: new Registers(this, 'IO_QSPI', {}, { 0x8: chipSelect }),
      0x40044: this.i2c[0],
      0x40060: new Registers(this, 'ROSC', {}, { 0x18: () => 0x80001000, 0x1c: randomBit }),
      0x40064: new Registers(this, 'VREG', { 0: 0xb1, 4: 0x91 }, { 0: voltage, 8: () => this.chipReset }),
    });
    const resets = this.peripherals[0x4000c];
    const writeResets = resets.writeUint32.bind(resets);
    resets.writeUint32 = (offset, value) => {
      writeResets(offset, value);
      if (offset === 0 && value & RESET_I2C0) this.i2c[0].cancel();
      if (offset === 0 && value & RESET_USB) this.onUsbReset();
    };
  }

  keepWatchdog(before) {
    const watchdog = (this.watchdog = this.peripherals[0x40058]);
    watchdog.onWatchdogTrigger = () => {
      watchdog.timer.enable = false;
      // It resets what WDSEL selects.
      if (!this.peripherals[0x40010].wdsel) return;
      this.onReset(watchdog.reason === 1 ? 'watchdog timed out' : 'watchdog forced', 'watchdog');
    };
    if (!before) return;
    watchdog.scratchData.set(before.watchdog.scratchData);
    watchdog.reason = before.watchdog.reason;
  }

  /** Counts from 0 at each start; rp2040js fires alarms up to 1 µs before their time. */
  startTimer(clock) {
    const timer = this.peripherals[0x40054];
    const start = clock.nanos;
    timer.clock = {
      get nanos() {
        return clock.nanos - start;
      },
    };
    const write = timer.writeUint32.bind(timer);
    timer.writeUint32 = (offset, value) => {
      write(offset, value);
      const alarm = timer.alarms[(offset - 0x10) / 4];
      if (!alarm) return;
      const now = timer.clock.nanos;
      const ticks = (value - Math.floor(now / 1000)) >>> 0;
      alarm.clockAlarm.schedule(Math.max(0, ticks * 1000 - (now % 1000)));
    };
  }

  allowSystemReset() {
    const { ppb } = this;
    const read = ppb.readUint32.bind(ppb);
    const write = ppb.writeUint32.bind(ppb);
    ppb.readUint32 = (offset) => (offset === AIRCR ? 0xfa050000 : read(offset));
    ppb.writeUint32 = (offset, value) => {
      if (offset !== AIRCR) write(offset, value);
      else if ((value & 0xffff0004) === SYSRESETREQ) {
        this.watchdog.reason = 0;
        this.onReset('system reset', 'watchdog');
      }
    };
  }

  /** Keeps the core busy for a while, as functions of the boot ROM do. */
  stall(ns) {
    this.stalledNs += ns;
  }

  /** Returns the time at which the core continues after its stalls, which began at `now`. */
  endStall(now) {
    const end = now + this.stalledNs;
    this.stalledNs = 0;
    return end;
  }

  // RAM first, for speed. Flash is not written by stores.
  writeUint32(address, value) {
    address >>>= 0;
    const offset = address - RAM;
    if (offset >= 0 && offset < RAM_SIZE) this.sramView.setUint32(offset, value, true);
    else if (address < ROM_SIZE) trap(this, address);
    else if (address >>> 24 === 0x10) this.onWarning(`store to flash at 0x${address.toString(16)}`);
    else super.writeUint32(address, value);
  }

  readUint32(address) {
    const offset = address - RAM;
    if (offset >= 0 && offset < RAM_SIZE - 3) return this.sramView.getUint32(offset, true);
    if (address >>> 24 === 0x10) return this.readFlash(address);
    return super.readUint32(address);
  }

  /** Reads through the XIP cache. Each line misses once, because code that is copied to RAM is read once. */
  readFlash(address) {
    if (!this.flashChip.isMapped) {
      if (!this.isDead) this.onWarning('the flash does not answer');
      this.isDead = true;
      return 0xffffffff;
    }
    if (address % LINE === 0) this.stall(LINE_CYCLES * this.cycleNs);
    return this.flashView.getUint32(address - FLASH, true);
  }

  readUint16(address) {
    const offset = address - RAM;
    if (offset >= 0 && offset < RAM_SIZE) return this.sramView.getUint16(offset, true);
    return address >>> 24 === 0x10 ? this.flash16[(address & 0xffffff) >> 1] : super.readUint16(address);
  }
}
