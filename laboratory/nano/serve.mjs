// Runs several boards in lock step with programs: node serve.mjs --uf2 F --part P --links FOLDER [options]; see the README of
// this folder. The sockets have the protocol of `virtual-board serve --lock-step`: the boards' time passes only while each
// program that has a port open waits for it.

import { mkdirSync, readFileSync } from 'node:fs';
import { createServer } from 'node:net';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { Board } from './board.mjs';
import { Part } from './part.mjs';

const STEP_NS = 1e6;
// From power-up until a port is there.
const STARTED_NS = 1e9;
// Of a request without its bytes: its kind, and a number.
const HEAD = 5;
const WRITE = 'W'.charCodeAt(0);
const RUN = 'R'.charCodeAt(0);
const PARK = 'P'.charCodeAt(0);

const text = { type: 'string' };
const { values: options } = parseArgs({
  options: {
    uf2: text,
    part: text,
    links: text,
    feet: { ...text, default: 'FL,FR,RL,RR' },
    motion: { ...text, default: 'walk' },
    flash: text,
    reason: { ...text, default: '0' },
    'scratch-0': { ...text, default: '0' },
    'busy-hub': { type: 'boolean' },
  },
});

/** A board, and the socket in the place of its serial port. */
class Line {
  received = Buffer.alloc(0);
  waiting = [];
  program = null;
  request = null;

  constructor(name, index) {
    this.name = name;
    const seed = String(index + 1);
    this.part = new Part(options.part, options.motion, seed);
    this.board = new Board({
      image: readFileSync(options.uf2),
      part: this.part,
      flash: options.flash && readFileSync(options.flash),
      flashKind: index % 2 ? 'is25lp128f' : 'at25sf128a',
      reason: Number(options.reason),
      scratch: [Number(options['scratch-0'])],
      uniqueId: [0x50, 0x44, 0x34, 0x15, 0x4b, 0x21, 0x07, index],
    });
    this.board.port.isHubBusy = options['busy-hub'];
    // A computer asserts DTR when a program opens the port.
    this.board.port.isOpen = false;
    this.board.port.received = (data) => this.program && this.waiting.push(Buffer.from(data));
    const path = join(options.links, `${name}.uart`);
    createServer((socket) => this.accept(socket)).listen(path, announce);
  }

  accept(socket) {
    if (this.program) return socket.destroy();
    this.program = socket;
    this.received = Buffer.alloc(0);
    this.board.open(true);
    socket.on('data', (data) => this.take(data));
    socket.on('error', () => {});
    socket.on('close', () => {
      this.program = this.request = null;
      this.waiting = [];
      this.board.open(false);
      turn();
    });
  }

  /** Takes a part of a request. */
  take(data) {
    this.received = Buffer.concat([this.received, data]);
    if (this.received.length < HEAD) return;
    const [kind, number] = [this.received[0], this.received.readUInt32LE(1)];
    if (![WRITE, RUN, PARK].includes(kind)) return this.program.destroy();
    const length = HEAD + (kind === WRITE ? number : 0);
    if (this.received.length < length) return;
    if (kind === WRITE) this.board.send(this.received.subarray(HEAD, length));
    this.request = { kind, end: now + number * 1e3 };
    this.received = this.received.subarray(length);
    if (kind === PARK) this.answer();
    turn();
  }

  isDue() {
    if (!this.request || this.request.kind === PARK) return false;
    return this.request.kind === WRITE || this.waiting.length || this.request.end <= now;
  }

  /** Answers the request with the time and the received bytes. */
  answer() {
    const output = this.request.kind === RUN ? Buffer.concat(this.waiting.splice(0)) : Buffer.alloc(0);
    const head = Buffer.alloc(12);
    head.writeBigUInt64LE(BigInt(Math.round(now / 1e3)));
    head.writeUInt32LE(output.length, 8);
    if (this.request.kind !== PARK) this.request = null;
    this.program.write(Buffer.concat([head, output]));
  }
}

// The boards' time, ns.
let now = 0;
let isPlanned = false;

/** Continues once the bytes from the programs have been read. */
function turn() {
  if (isPlanned) return;
  isPlanned = true;
  setImmediate(() => {
    isPlanned = false;
    advance();
  });
}

/** Lets time pass while each program waits, until one is answered: it is its turn then. */
function advance() {
  const programs = lines.filter((line) => line.program);
  if (programs.some((line) => !line.request)) return;
  if (!programs.some((line) => line.request.kind !== PARK)) return;
  const due = lines.find((line) => line.isDue());
  if (due) return due.answer();
  now += STEP_NS;
  for (const { board } of lines) board.run(now);
  turn();
}

let announced = 0;
/** Says that all ports are there: each board has started, and no program has opened its port yet. */
function announce() {
  announced += 1;
  if (announced < lines.length) return;
  now = STARTED_NS;
  for (const { board } of lines) board.run(now);
  console.log('ready');
}

mkdirSync(options.links, { recursive: true });
const lines = options.feet.split(',').map((name, index) => new Line(name, index));

/** Ends with its standard input, and reports on each board. */
process.stdin.on('end', () => {
  const report = ({ name, board }) => [
    name,
    { resets: board.resets, enumerated: board.port.enumerated, warnings: [...board.warnings], busyShare: board.busyNs / board.now },
  ];
  console.log(JSON.stringify({ seconds: now / 1e9, boards: Object.fromEntries(lines.map(report)) }));
  lines.forEach((line) => line.part.close());
  process.exit();
});
process.stdin.resume();
