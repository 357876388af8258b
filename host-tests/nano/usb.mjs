// The computer at the USB socket: it enumerates a serial port, asserts DTR, reads, and sends.

import { createSetupPacket, DataDirection, SetupRecipient, SetupType } from 'rp2040js';

// Of a buffer control word.
const AVAILABLE = 1 << 10;
const STALL = 1 << 11;
const FULL = 1 << 15;
const LENGTH = 0x3ff;
const BUFFER_CONTROLS = 0x80;

const PULLUP_EN = 1 << 16;
const DEVICE = 1;
const CONFIGURATION = 2;
const STRING = 3;
const US_ENGLISH = 0x0409;

const RESET_NS = 10e6;
const REQUEST_NS = 200e3;
// A packet of 64 bytes with its token and handshake, at 12 Mbit/s.
const PACKET_NS = 55e3;

/** rp2040js completes transfers when they are armed: a host that does not read, or has nothing to send, is not possible. */
export class UsbHost {
  /** `port` outlives the chip: what has been read, whether it reads, and what it still has to send. */
  constructor(chip, port) {
    this.chip = chip;
    this.port = port;
    this.usb = chip.usbCtrl;
    this.endpoints = { in: -1, out: -1 };
    this.tokens = new Map();
    port.host = this;
    this.usb.DPRAMUpdated = (offset, value) => this.armed(offset, value);
    const attach = chip.clock.createAlarm(() => this.usb.resetDevice());
    this.usb.handleSieCtrlWrite = (value) => {
      if (value & PULLUP_EN && !(this.usb.sieCtrl & PULLUP_EN)) attach.schedule(RESET_NS);
      this.usb.sieCtrl = value;
    };
    this.usb.onResetReceived = () => {
      this.requests = this.enumerate();
      this.next(undefined);
    };
    this.gap = chip.clock.createAlarm(() => this.usb.sendSetupPacket(this.request.setup));
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
    yield standard(9, 1);
    const lineCoding = Uint8Array.of(0x00, 0xc2, 0x01, 0x00, 0, 0, 8);
    yield { setup: setup(DataDirection.HostToDevice, SetupType.Class, SetupRecipient.Interface, 0x20, 0, 0, 7), data: lineCoding };
    yield { setup: setup(DataDirection.HostToDevice, SetupType.Class, SetupRecipient.Interface, 0x22, 0b11, 0, 0) };
    port.enumerated += 1;
    this.moved();
  }

  next(answer) {
    const { value, done } = this.requests.next(answer);
    this.request = done ? null : { ...value, answer: [], isRead: !!(value.setup[0] & 0x80) };
    if (!done) this.gap.schedule(REQUEST_NS);
  }

  /** The device has written a buffer control word. */
  armed(offset, value) {
    if (offset < BUFFER_CONTROLS || offset >= 0x100) return;
    const endpoint = (offset - BUFFER_CONTROLS) >> 3;
    const out = !!(offset & 4);
    if (endpoint === 0 && value & STALL && !out && this.request) this.next(null);
    else if (value & AVAILABLE) this.token(endpoint, out);
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
