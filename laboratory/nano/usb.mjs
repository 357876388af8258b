// The computer at the USB socket: it enumerates a serial port, sets its rate and DTR, reads, and sends.

import { createSetupPacket, DataDirection, SetupRecipient, SetupType } from 'rp2040js';

// Of a buffer control word.
const AVAILABLE = 1 << 10;
const STALL = 1 << 11;
const FULL = 1 << 15;
const LENGTH = 0x3ff;
const BUFFER_CONTROLS = 0x80;

const PULLUP_EN = 1 << 16;

// Of the SIE's status and the raw interrupts.
const CONNECTED = 1 << 16;
const LINE_STATE = 3 << 2;
const LINE_J = 1 << 2;
const BUS_RESET = 1 << 19;
const DEV_SOF = 1 << 17;
const SOF_RD = 0x48;
const SIE_STATUS = 0x50;
const USB_MUXING = 0x74;
const TO_DIGITAL_PAD = 1 << 2;
const DEVICE = 1;
const CONFIGURATION = 2;
const STRING = 3;
const US_ENGLISH = 0x0409;

// A host waits for a plug to settle, resets the bus, and waits again before its first request.
const SETTLE_NS = 10e6;
const RESET_NS = 10e6;
const RECOVERY_NS = 10e6;
const FRAME_NS = 1e6;
// The device connects after so long an idle bus (RP2040-E5).
const IDLE_NS = 0.8e6;
const REQUEST_NS = 200e3;
// A packet of 64 bytes with its token and handshake, at 12 Mbit/s.
const PACKET_NS = 55e3;

/** rp2040js completes transfers when they are armed: a host that does not read, or has nothing to send, is not possible. */
export class UsbHost {
  /** `port` outlives the chip. It holds the bytes that were read, whether it reads, and the bytes that are still to be sent. */
  constructor(chip, port) {
    this.chip = chip;
    this.port = port;
    this.usb = chip.usbCtrl;
    this.endpoints = { in: -1, out: -1 };
    this.tokens = new Map();
    port.host = this;
    this.usb.DPRAMUpdated = (offset, value) => this.armed(offset, value);
    this.isHung = false;
    this.attach = chip.clock.createAlarm(() => this.resetBus());
    this.usb.handleSieCtrlWrite = (value) => {
      if (value & PULLUP_EN && !(this.usb.sieCtrl & PULLUP_EN)) this.attach.schedule(SETTLE_NS);
      this.usb.sieCtrl = value;
    };
    // When a program clears the status of a bus reset, the package treats the bus as idle.
    this.usb.onResetReceived = () => {};
    this.resetEnd = chip.clock.createAlarm(() => this.endReset());
    this.recovered = chip.clock.createAlarm(() => this.start());
    this.frame = chip.clock.createAlarm(() => this.startFrame());
    this.watchRegisters();
    chip.onUsbReset = () => this.detach();
    this.gap = chip.clock.createAlarm(() => this.isHung || this.usb.sendSetupPacket(this.request.setup));
  }

  /** What the package has otherwise than the controller: the state of the lines, and the start of frames. */
  watchRegisters() {
    const { usb } = this;
    const read = usb.readUint32.bind(usb);
    const write = usb.writeUint32.bind(usb);
    usb.readUint32 = (offset) => {
      const value = read(offset);
      if (offset === SIE_STATUS) return (value & ~(LINE_STATE | CONNECTED)) | this.lines | (this.isConnected ? CONNECTED : 0);
      if (offset === SOF_RD) this.setSof(false);
      return value;
    };
    usb.writeUint32 = (offset, value) => {
      write(offset, value);
      if (offset === USB_MUXING) this.force(!!(value & TO_DIGITAL_PAD));
    };
    this.lines = LINE_J;
    this.isConnected = false;
    this.connect = this.chip.clock.createAlarm(() => (this.isConnected = true));
  }

  /** Starts a reset of the bus: both lines low. */
  resetBus() {
    this.lines = 0;
    this.isConnected = false;
    this.frame.cancel();
    this.requests = this.request = null;
    this.endpoints = { in: -1, out: -1 };
    this.usb.sieStatus |= BUS_RESET;
    this.usb.sieStatusUpdated();
    this.resetEnd.schedule(RESET_NS);
  }

  /** Ends it. Behind a busy hub the lines do not stay idle: others' packets pass. */
  endReset() {
    this.lines = LINE_J;
    this.frame.schedule(FRAME_NS);
    if (!this.port.isHubBusy) this.connect.schedule(IDLE_NS);
    this.recovered.schedule(RECOVERY_NS);
  }

  /** The program takes the lines away from the transceiver, or gives them back. */
  force(isForced) {
    if (isForced) this.connect.schedule(IDLE_NS);
    else if (this.port.isHubBusy && !this.isConnected) this.connect.cancel();
  }

  /** Makes the first request, of a device that has connected. */
  start() {
    if (!this.isConnected) return this.attach.schedule(0);
    this.requests = this.enumerate();
    this.next(undefined);
  }

  startFrame() {
    this.frame.schedule(FRAME_NS);
    if (this.isHung || !this.isConnected) return;
    this.frameStart = this.chip.clock.nanos;
    this.usb.sofFrameNumber = (this.usb.sofFrameNumber + 1) & 0x7ff;
    this.setSof(true);
  }

  setSof(isSet) {
    this.usb.intRaw = isSet ? this.usb.intRaw | DEV_SOF : this.usb.intRaw & ~DEV_SOF;
    this.usb.checkInterrupts();
  }

  /** Hangs the controller, as a corrupted packet can (RP2040-E15): only its reset ends that. */
  hang() {
    this.isHung = true;
  }

  /** The controller is reset: the host sees its pull-up go. */
  detach() {
    for (const alarm of [this.attach, this.resetEnd, this.recovered, this.frame, this.connect, this.gap]) alarm.cancel();
    this.isHung = this.isConnected = false;
    this.requests = this.request = null;
    this.endpoints = { in: -1, out: -1 };
    Object.assign(this.usb, { sieCtrl: 0, sieStatus: 0, intEnable: 0, buffStatus: 0, intRaw: 0 });
    this.usb.checkInterrupts();
  }

  /** The requests, in order; each yields the bytes of its answer, or null if the device refuses. */
  *enumerate() {
    const { port } = this;
    const device = yield standard(6, DEVICE << 8, 0, 18);
    yield standard(5, 1);
    const head = yield standard(6, CONFIGURATION << 8, 0, 9);
    const configuration = yield standard(6, CONFIGURATION << 8, 0, head[2] | (head[3] << 8));
    port.id = [device[8] | (device[9] << 8), device[10] | (device[11] << 8)];
    for (const [name, index] of [['manufacturer', device[14]], ['product', device[15]], ['serial', device[16]]]) {
      const text = index && (yield standard(6, (STRING << 8) | index, US_ENGLISH, 255));
      port.strings[name] = text ? Buffer.from(text.slice(2)).toString('utf16le') : null;
    }
    this.endpoints = bulkEndpoints(configuration);
    port.maxPowerMa = 2 * configuration[8];
    yield standard(9, 1);
    yield* this.lineRequests();
    port.enumerated += 1;
    this.moved();
  }

  /** Tells the device the port's rate and whether it is open, or lets `next` do so after the present request. */
  setLines() {
    if (this.request || this.endpoints.in < 0) return;
    this.requests = this.lineRequests();
    this.next(undefined);
  }

  /** The requests that tell the device the port's rate, and then whether it is open. */
  *lineRequests() {
    const { port } = this;
    const { baud, isOpen } = port;
    this.reportedOpen = isOpen;
    yield lineCoding(baud);
    yield lines(isOpen);
    port.answered = { baud, isOpen };
  }

  next(answer) {
    const { value, done } = this.requests.next(answer);
    this.request = done ? null : { ...value, answer: [], isRead: !!(value.setup[0] & 0x80) };
    if (!done) this.gap.schedule(REQUEST_NS);
    // A port may be opened while the device is told that it was closed: no time passes between two programs in lock step.
    else if (this.reportedOpen !== this.port.isOpen) this.setLines();
  }

  /** The device has written a buffer control word. */
  armed(offset, value) {
    if (offset < BUFFER_CONTROLS || offset >= 0x100) return;
    const endpoint = (offset - BUFFER_CONTROLS) >> 3;
    const out = !!(offset & 4);
    if (endpoint === 0 && value & STALL && !out && this.request) this.next(null);
    else if (value & AVAILABLE) {
      if (endpoint === this.endpoints.in && !out) this.note();
      this.token(endpoint, out);
    }
  }

  /** Notes when in its frame a packet for the host became ready. A hung controller sees no frames. */
  note() {
    if (this.isHung) return;
    const us = (this.chip.clock.nanos - this.frameStart) / 1e3;
    if (us > this.port.latestArmUs) this.port.latestArmUs = us;
  }

  /** Goes on after the port has changed. */
  moved() {
    if (this.endpoints.in < 0) return;
    this.token(this.endpoints.in, false);
    this.token(this.endpoints.out, true);
  }

  /** Transfers a packet in the time of one, if both sides are ready then. */
  token(endpoint, out) {
    const key = 2 * endpoint + out;
    if (!this.tokens.has(key))
      this.tokens.set(key, this.chip.clock.createAlarm(() => this.transfer(endpoint, out, BUFFER_CONTROLS + 4 * key)));
    this.tokens.get(key).schedule(PACKET_NS);
  }

  transfer(endpoint, out, offset) {
    if (this.isHung) return;
    const dpram = this.chip.usbDPRAMView;
    const word = dpram.getUint32(offset, true);
    if (!(word & AVAILABLE)) return;
    const buffer = this.usb.getEndpointBufferOffset(endpoint, out);
    const size = word & LENGTH;
    const data = out ? this.toDevice(endpoint, size) : this.chip.usbDPRAM.slice(buffer, buffer + size);
    if (!data || (!out && !this.fromDevice(endpoint, data))) return;
    if (out) this.chip.usbDPRAM.set(data, buffer);
    const left = word & ~(AVAILABLE | FULL | LENGTH);
    dpram.setUint32(offset, left | data.length | (out ? FULL : 0), true);
    this.usb.indicateBufferReady(endpoint, out);
    if (endpoint === 0) this.advance(out, data);
  }

  /** The next packet for the device; null without one. */
  toDevice(endpoint, size) {
    if (endpoint === 0) return this.request?.data ?? new Uint8Array(0);
    const { unsent } = this.port;
    return endpoint === this.endpoints.out && unsent.length ? Uint8Array.from(unsent.splice(0, size)) : null;
  }

  /** Takes a packet; false if the host does not read now. */
  fromDevice(endpoint, data) {
    if (endpoint !== this.endpoints.in) return true;
    if (!this.port.isDeaf) this.port.received(data);
    return !this.port.isDeaf;
  }

  /** A packet of the control endpoint has passed. The last of a request goes against the direction of its data. */
  advance(out, data) {
    if (!this.request) return;
    if (out === this.request.isRead) this.next(this.request.answer);
    else if (!out) this.request.answer.push(...data);
  }
}

function setup(dataDirection, type, recipient, bRequest, wValue, wIndex, wLength) {
  return createSetupPacket({ dataDirection, type, recipient, bRequest, wValue, wIndex, wLength });
}

/** A request that sets the rate, with eight data bits, one stop bit and no parity. */
function lineCoding(baud) {
  const data = new Uint8Array(7);
  new DataView(data.buffer).setUint32(0, baud, true);
  data[6] = 8;
  return { setup: setup(DataDirection.HostToDevice, SetupType.Class, SetupRecipient.Interface, 0x20, 0, 0, data.length), data };
}

/** A request that sets DTR and RTS. */
function lines(isOpen) {
  const state = isOpen ? 0b11 : 0b00;
  return { setup: setup(DataDirection.HostToDevice, SetupType.Class, SetupRecipient.Interface, 0x22, state, 0, 0) };
}

/** A standard request; one with a length reads. */
function standard(request, value, index = 0, length = 0) {
  const direction = length ? DataDirection.DeviceToHost : DataDirection.HostToDevice;
  return { setup: setup(direction, SetupType.Standard, SetupRecipient.Device, request, value, index, length) };
}

/** Numbers of the bulk endpoints: those of the serial port's data. */
function bulkEndpoints(configuration) {
  const found = { in: -1, out: -1 };
  for (let at = 0; at < configuration.length; at += configuration[at]) {
    const [, type, address, attributes] = configuration.slice(at, at + 4);
    if (type === 5 && (attributes & 3) === 2) found[address & 0x80 ? 'in' : 'out'] = address & 0xf;
  }
  return found;
}
