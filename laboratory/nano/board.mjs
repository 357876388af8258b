// The board: the chip, the sensor on its wires, the yellow LED, the USB socket, and time.

import { RP2040 } from 'rp2040js';
import { Chip } from './chip.mjs';
import { load } from './uf2.mjs';
import { UsbHost } from './usb.mjs';

const LED = 6;
const SDA = 12;
const SCL = 13;
const INT1 = 24;
const RADIO_RESET = 3;
// Of a pin that is driven.
const LOW = 0;
const HARD_FAULT = 3;
const SENSOR = 0x6a;
// Of a data-ready pulse.
const PULSE_NS = 75e3;
const FLASH_SIZE = 16 << 20;

/** The sensor's wires: I2C, and INT1. */
class Wires {
  isConnected = true;
  stuck = false;
  transfers = 0;
  refused = 0;
  edges = 0;
  written = [];

  constructor(board, part) {
    this.board = board;
    this.part = part;
    this.edge = null;
  }

  connect(address, isRead) {
    this.flush();
    this.transfers += 1;
    const acknowledged = address === SENSOR && this.isConnected && (isRead || this.part.write(this.board.now, [0x0f]));
    this.refused += acknowledged ? 0 : 1;
    return acknowledged;
  }

  write(value) {
    this.written.push(value);
    return this.isConnected;
  }

  read() {
    this.flush();
    return (this.isConnected && this.part.read(this.board.now, 1)?.[0]) || 0;
  }

  /** Passes the written bytes on. A stop or a restart ends a write. */
  flush() {
    const written = this.written.splice(0);
    if (!written.length || !this.isConnected) return;
    this.part.write(this.board.now, written);
    if (written.length > 1) this.follow();
  }

  stop() {
    this.flush();
    if (this.board.chip.gpio[INT1].rawInputValue) this.follow();
  }

  /** Sets INT1 to its level, and waits for the next edge. */
  follow() {
    const { board } = this;
    const { high, next } = this.isConnected ? this.part.int1(board.now) : { high: false, next: Infinity };
    this.drive(high);
    board.cancel(this.edge);
    this.edge = board.at(high ? Math.min(next, board.now + PULSE_NS) : next, () => this.rise(next));
  }

  rise(next) {
    if (this.board.now < next) return this.follow();
    this.drive(false);
    this.drive(true);
    this.edge = this.board.at(this.board.now + PULSE_NS, () => this.follow());
  }

  drive(high) {
    const pin = this.board.chip.gpio[INT1];
    if (pin.rawInputValue === high) return;
    this.edges += high ? 1 : 0;
    pin.setInputValue(high);
  }
}

export class Board {
  resets = [];
  warnings = new Set();
  usbBoot = null;
  busyNs = 0;
  led = { isOn: false, changes: 0 };
  lit = [];
  port = {
    strings: {},
    id: null,
    enumerated: 0,
    maxPowerMa: 0,
    isOpen: true,
    baud: 115_200,
    // What the last requests about the port said that the device has answered: its rate, and whether it is open.
    answered: null,
    isDeaf: false,
    isHubBusy: false,
    latestArmUs: 0,
    unsent: [],
    received: () => {},
  };
  agenda = new Map();

  /**
   * `image` is a UF2 or raw flash. `flash`, if given, is the previous content of the flash. `flashKind` names the flash chip.
   * `reason` and `scratch` are registers of the watchdog at the first start.
   */
  constructor({ image, part, flash, flashKind, reason, scratch, uniqueId }) {
    this.flashKind = flashKind;
    this.flash = new Uint8Array(FLASH_SIZE).fill(0xff);
    if (flash) this.flash.set(flash);
    if (image) load(image, this.flash);
    this.uniqueId = uniqueId;
    this.wires = new Wires(this, part);
    // The package does not export its clock.
    this.clock = new RP2040().clock;
    this.start('power', { reason, scratch });
  }

  /** Emulated time since power-up, ns. */
  get now() {
    return this.clock.nanos;
  }

  /** Starts the chip after power-up or a reset; the world around it goes on. */
  start(cause, { reason = 0, scratch = [] } = {}) {
    const { clock, flash, flashKind, uniqueId, wires } = this;
    clock.nextAlarm = null;
    this.pendingReset = null;
    const chip = new Chip(clock, { flash, flashKind, uniqueId, wires, before: this.chip, cause });
    if (cause === 'power') {
      chip.watchdog.reason = reason;
      chip.watchdog.scratchData.set(scratch);
    }
    this.chip = chip;
    for (const [alarm, ns] of this.agenda) clock.linkAlarm(ns - clock.nanos, alarm);
    chip.onReset = (reason, cause) => (this.pendingReset ??= { reason, cause });
    chip.onUsbBoot = (call) => (this.usbBoot = call);
    chip.onWarning = (message) => this.warnings.size < 20 && this.warnings.add(message);
    chip.gpio[SDA].setInputValue(!wires.stuck);
    chip.gpio[SCL].setInputValue(true);
    chip.gpio[SCL].addListener((state) => {
      if (state === 0 && this.wires.stuck && --this.clocks <= 0) this.hold(false);
    });
    chip.gpio[LED].addListener((state) => this.setLed(state === 1));
    this.setLed(false);
    new UsbHost(chip, this.port);
    wires.follow();
  }

  setLed(isOn) {
    if (isOn === this.led.isOn) return;
    this.led = { isOn, changes: this.led.changes + 1 };
    if (isOn) this.litFrom = this.now;
    else this.lit.push([this.litFrom, this.now]);
  }

  /** Does `action` at a time; resets of the chip do not prevent it. Returns a handle for `cancel`. */
  at(ns, action) {
    if (ns === Infinity) return null;
    const alarm = this.clock.createAlarm(() => {
      this.agenda.delete(alarm);
      action();
    });
    this.agenda.set(alarm, ns);
    alarm.schedule(ns - this.now);
    return alarm;
  }

  cancel(alarm) {
    if (this.agenda.delete(alarm)) alarm.cancel();
  }

  /** Unplugs the sensor, which then loses its settings, or plugs it in again. */
  plug(isConnected) {
    this.wires.isConnected = isConnected;
    if (isConnected) this.wires.part.inject(this.now, 'reset');
    this.wires.follow();
  }

  /** Holds SDA low, or releases it; so do `clocks` on SCL, driven as an output. */
  hold(isStuck, clocks = Infinity) {
    this.wires.stuck = isStuck;
    this.clocks = clocks;
    this.chip.gpio[SDA].setInputValue(!isStuck);
    if (!isStuck) this.chip.i2c[0].resume();
  }

  /** Stops or continues reading from the serial port. */
  deafen(isDeaf) {
    this.port.isDeaf = isDeaf;
    this.port.host.moved();
  }

  /** Presses the button for reset. */
  press() {
    this.chip.onReset('button', 'run');
  }

  /** Lets the core take a fault, as a jump to nothing does. */
  fault() {
    this.chip.core.exceptionEntry(HARD_FAULT);
  }

  /** Opens the serial port, which asserts DTR, or closes it. Sets its rate before. */
  open(isOpen, baud = this.port.baud) {
    Object.assign(this.port, { isOpen, baud });
    this.port.host.setLines();
  }

  /** Whether the radio module is held in reset. */
  get isRadioHeld() {
    return this.chip.gpio[RADIO_RESET].value === LOW;
  }

  /** Time for which the LED was lit since a time, ns. */
  litSince(ns) {
    const times = this.led.isOn ? [...this.lit, [this.litFrom, this.now]] : this.lit;
    return times.reduce((sum, [from, to]) => sum + Math.max(0, to - Math.max(from, ns)), 0);
  }

  send(bytes) {
    this.port.unsent.push(...bytes);
    this.port.host.moved();
  }

  /** Runs until a time, ns, or until the program calls the boot loader. */
  run(until) {
    const { clock } = this;
    while (clock.nanos < until && !this.usbBoot) {
      const { chip } = this;
      const { core } = chip;
      if (core.waiting || chip.isDead) {
        // Nothing happens until the next alarm.
        clock.tick(Math.min(clock.nextAlarm?.nanos ?? until, until) - clock.nanos);
      } else {
        const began = clock.nanos;
        do {
          let now = clock.nanosCounter + core.executeInstruction() * chip.cycleNs;
          if (chip.stalledNs) now = chip.endStall(now);
          const { nextAlarm } = clock;
          // What `tick` does without an alarm, which is nearly always.
          if (nextAlarm === null || nextAlarm.nanos > now) clock.nanosCounter = now;
          else clock.tick(now - clock.nanosCounter);
        } while (!core.waiting && !chip.isDead && !this.pendingReset && !this.usbBoot && clock.nanosCounter < until);
        this.busyNs += clock.nanos - began;
      }
      if (!this.pendingReset) continue;
      const { reason, cause } = this.pendingReset;
      this.resets.push({ ms: clock.nanos / 1e6, reason });
      this.start(cause);
    }
  }
}
