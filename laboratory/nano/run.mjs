// Runs a program on the emulated board: node run.mjs --uf2 F --part P [options]; see the README of this folder.

import { existsSync, openSync, readFileSync, writeFileSync, writeSync } from 'node:fs';
import { setTimeout } from 'node:timers/promises';
import { parseArgs } from 'node:util';
import { Board } from './board.mjs';
import { Part } from './part.mjs';

// Time slice of a live board.
const SLICE_NS = 5e6;

const text = { type: 'string' };
const list = { type: 'string', multiple: true, default: [] };
const { values: options } = parseArgs({
  options: {
    uf2: text,
    part: text,
    motion: { ...text, default: 'walk' },
    seed: { ...text, default: '1' },
    seconds: { ...text, default: '10' },
    output: text,
    live: { type: 'boolean' },
    flash: text,
    'flash-chip': { ...text, default: 'at25sf128a' },
    'unique-id': { ...text, default: '504434154b21071c' },
    reason: { ...text, default: '0' },
    'scratch-0': { ...text, default: '0' },
    'busy-hub': { type: 'boolean' },
    'open-at-ms': list,
    'close-at-ms': list,
    'press-at-ms': list,
    'crash-at-ms': list,
    'hang-usb-at-ms': list,
    'unplug-ms': list,
    'stuck-ms': list,
    'deaf-ms': list,
    'send-at-ms': list,
    'fault-at-ms': list,
  },
});

const part = new Part(options.part, options.motion, options.seed);
const flash = options.flash && existsSync(options.flash) ? readFileSync(options.flash) : undefined;
const image = options.uf2 && readFileSync(options.uf2);
const board = new Board({
  image,
  part,
  flash,
  flashKind: options['flash-chip'],
  uniqueId: Buffer.from(options['unique-id'], 'hex'),
  reason: Number(options.reason),
  scratch: [Number(options['scratch-0'])],
});
board.port.isHubBusy = options['busy-hub'];
board.port.isOpen = !options['open-at-ms'].length;

let received = 0;
const output = options.output && openSync(options.output, 'w');
board.port.received = (data) => {
  received += data.length;
  if (output) writeSync(output, data);
  if (options.live) process.stdout.write(data);
};

for (const [name, change] of [
  ['unplug-ms', (on) => board.plug(!on)],
  ['stuck-ms', (on, lasts) => board.hold(on, lasts ? 9 : Infinity)],
  ['deaf-ms', (on) => board.deafen(on)],
]) {
  for (const range of options[name]) {
    const [from, to] = range.split('-');
    board.at(from * 1e6, () => change(true, !to));
    if (to) board.at(to * 1e6, () => change(false));
  }
}
for (const [name, action] of [
  ['open-at-ms', () => board.open(true)],
  ['close-at-ms', (baud) => board.open(false, Number(baud))],
  ['press-at-ms', () => board.press()],
  ['crash-at-ms', () => board.fault()],
  ['hang-usb-at-ms', () => board.port.host.hang()],
  ['send-at-ms', (hex) => board.send(Buffer.from(hex, 'hex'))],
  ['fault-at-ms', (fault) => part.inject(board.now, fault)],
]) {
  for (const entry of options[name]) {
    const [ms, what] = entry.split(':');
    if (ms !== 'never') board.at(ms * 1e6, () => action(what));
  }
}

const began = process.hrtime.bigint();
const wallNs = () => Number(process.hrtime.bigint() - began);
if (options.live) {
  process.stdin.on('data', (data) => board.send(data));
  let ended = false;
  process.stdin.on('end', () => (ended = true));
  while (!ended) {
    await setTimeout(Math.max(0, (board.now - wallNs()) / 1e6));
    board.run(board.now + SLICE_NS);
  }
} else {
  board.run(options.seconds * 1e9);
}
const wallSeconds = wallNs() / 1e9;
if (options.flash) writeFileSync(options.flash, board.flash);
part.close();

const seconds = board.now / 1e9;
const { wires, port, chip } = board;
const summary = {
  usb: {
    ...port.strings,
    id: port.id?.map((id) => id.toString(16).padStart(4, '0')),
    enumerated: port.enumerated,
    answered: port.answered,
    maxPowerMa: port.maxPowerMa,
    latestArmUs: port.latestArmUs,
  },
  seconds,
  wallSeconds,
  busyShare: board.busyNs / board.now,
  clockMhz: chip.clkSys / 1e6,
  received,
  resets: board.resets,
  i2c: { transfers: wires.transfers, refused: wires.refused },
  edges: wires.edges,
  led: { ...board.led, litMsInLastSecond: board.litSince(board.now - 1e9) / 1e6 },
  isRadioHeld: board.isRadioHeld,
  flash: chip.flashLog,
  usbBoot: board.usbBoot,
  warnings: [...board.warnings],
};
(options.live ? console.error : console.log)(JSON.stringify(summary, null, 2));
