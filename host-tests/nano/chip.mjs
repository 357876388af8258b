// The RP2040: what rp2040js 1.4.1 lacks, or has otherwise than embassy-rp needs it.

import { BasePeripheral, RP2040 } from 'rp2040js';
import { speedUp } from './core.mjs';
import { I2c } from './i2c.mjs';
import { image, trap } from './rom.mjs';

const RAM = 0x20000000;
const RAM_SIZE = 0x42000;
const FLASH = 0x10000000;
const VECTORS = FLASH + 0x100;
const ROM_SIZE = 0x4000;
const AIRCR = 0xd0c;
const SYSRESETREQ = 0x05fa0004;
const HARD_FAULT = 3;
const I2C0_IRQ = 23;
const RESET_I2C0 = 1 << 3;

// embassy-rp writes zeros to all registers of USB, the hold time of I2C's SDA, and what wakes a dormant chip: to no
// effect here.
const UNSUNG = ['USB', 'I2C0', 'IO_BANK0_BASE'];

/** Registers that keep what is written; some read as something else. */
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

/** The flash chip's commands, as the second boot stage and `embassy_rp::flash` send them one by one. */
class Ssi extends Registers {
  constructor(chip, name, uniqueId) {
    super(chip, name, {}, { 0x28: () => 0x6 | (this.answers.length ? 0x8 : 0), 0x60: () => this.answers.shift() ?? 0 });
    this.answers = [];
    this.sent = 0;
    // By command: unique id after four dummy bytes, the AT25SF128A's identity, and status with quad enable set.
    this.replies = { 0x4b: [0, 0, 0, 0, ...uniqueId], 0x9f: [0x1f, 0x89, 0x01], 0x05: [0], 0x35: [2] };
  }

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    if (offset === 0x08) [this.answers, this.sent] = [[], 0];
    if (offset !== 0x60) return;
    // A command has ended when all its answers have been read.
    if (!this.answers.length) this.sent = 0;
    if (this.sent === 0) this.reply = this.replies[value & 0xff] ?? [];
    const isRead = ((this.values[0] >> 8) & 3) === 3;
    if (isRead) this.answers = [...this.reply];
    else this.answers.push(this.sent ? (this.reply[this.sent - 1] ?? 0) : 0);
    this.sent += 1;
  }
}

export class Chip extends RP2040 {
  /** Starts a program in `flash`. After a reset `before` is the chip from which RAM and the watchdog's registers stay. */
  constructor(clock, { flash, uniqueId, wires, before }) {
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
    this.onWarning = this.onReset = this.onUsbBoot = () => {};
    this.flash = flash;
    this.flash16 = new Uint16Array(flash.buffer);
    this.flashView = new DataView(flash.buffer);
    this.flashLog = before?.flashLog ?? { erased: 0, programmed: 0 };
    this.bootrom.set(image());
    this.isBootselPressed = false;
    this.stalledNs = 0;
    this.cycleNs = 1e9 / this.clkSys;
    this.addClockListener((hertz) => (this.cycleNs = 1e9 / hertz));
    this.addPeripherals(uniqueId, wires);
    this.keepWatchdog(before);
    this.startTimer(clock);
    this.allowSystemReset();
    this.onBreak = () => this.core.exceptionEntry(HARD_FAULT);
    if (before) this.sram.set(before.sram);
    // The second boot stage would start quad reads, and jump to the vectors.
    this.core.VTOR = VECTORS;
    this.core.reset();
    speedUp(this.core, this);
  }

  addPeripherals(uniqueId, wires) {
    let random = 1;
    const randomBit = () => (random = Math.imul(random, 1103515245) + 12345) >>> 31;
    const chipSelect = () => (this.isBootselPressed ? 0 : 0xa0000);
    const voltage = () => (this.peripherals[0x40064].values[0] | 0x1000) >>> 0;
    this.i2c[0] = new I2c(this, 'I2C0', I2C0_IRQ, wires);
    Object.assign(this.peripherals, {
      0x14000: new Registers(this, 'XIP_CTRL', {}, { 0x8: () => 3 }),
      0x18000: new Ssi(this, 'SSI', uniqueId),
      0x40018: new Registers(this, 'IO_QSPI', {}, { 0x8: chipSelect }),
      0x40044: this.i2c[0],
      0x40060: new Registers(this, 'ROSC', {}, { 0x18: () => 0x80001000, 0x1c: randomBit }),
      0x40064: new Registers(this, 'VREG', { 0: 0xb1, 4: 0x91, 8: 0x100 }, { 0: voltage }),
    });
    const resets = this.peripherals[0x4000c];
    const writeResets = resets.writeUint32.bind(resets);
    resets.writeUint32 = (offset, value) => {
      writeResets(offset, value);
      if (offset === 0 && value & RESET_I2C0) this.i2c[0].cancel();
    };
  }

  keepWatchdog(before) {
    const watchdog = (this.watchdog = this.peripherals[0x40058]);
    watchdog.onWatchdogTrigger = () => {
      watchdog.timer.enable = false;
      this.onReset(watchdog.reason === 1 ? 'watchdog timed out' : 'watchdog forced');
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
        this.onReset('system reset');
      }
    };
  }

  /** Keeps the core busy for a while, as functions of the boot ROM do. */
  stall(ns) {
    this.stalledNs += ns;
  }

  /** Returns the time after what has stalled the core at `now`. */
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
    return super.readUint32(address);
  }

  readUint16(address) {
    return address >>> 24 === 0x10 ? this.flash16[(address & 0xffffff) >> 1] : super.readUint16(address);
  }
}
