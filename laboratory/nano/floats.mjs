// Calls the program's additions and multiplications of f32 in the emulator, and compares them with this machine's:
// node floats.mjs --elf F --uf2 F [--pairs N]

import { readFileSync } from 'node:fs';
import { parseArgs } from 'node:util';
import { Board } from './board.mjs';

const { values: options } = parseArgs({
  options: {
    elf: { type: 'string' },
    uf2: { type: 'string' },
    pairs: { type: 'string', default: '200000' },
  },
});

/** Addresses of functions, by their names in the symbols of an ELF of 32 bits. */
function functions(elf) {
  const view = new DataView(elf.buffer, elf.byteOffset, elf.length);
  const word = (at) => view.getUint32(at, true);
  const [sections, size, count] = [word(32), view.getUint16(46, true), view.getUint16(48, true)];
  const found = {};
  for (let section = sections; section < sections + size * count; section += size) {
    if (word(section + 4) !== 2) continue;
    const names = word(sections + size * word(section + 24) + 16);
    const begin = word(section + 16);
    for (let symbol = begin; symbol < begin + word(section + 20); symbol += 16) {
      const from = names + word(symbol);
      found[elf.toString('latin1', from, elf.indexOf(0, from))] = word(symbol + 4) & ~1;
    }
  }
  return found;
}

const silent = { write: () => true, read: (_, count) => Array(count).fill(0), int1: () => ({ high: false, next: Infinity }), inject: () => {} };
const uniqueId = new Uint8Array(8);
const board = new Board({ image: readFileSync(options.uf2), part: silent, flashKind: 'at25sf128a', uniqueId });
// The program copies itself to RAM.
board.run(0.5e9);
const { core } = board.chip;
core.PM = true;
core.waiting = false;
// Where no function is.
const RETURN = 0x20041000;

/** Calls a function of two numbers; also counts its cycles, without those of the call. */
function call(address, a, b) {
  const { registers } = core;
  [registers[0], registers[1], registers[14], registers[15]] = [a | 0, b | 0, RETURN | 1, address];
  let cycles = 0;
  while (registers[15] >>> 0 !== RETURN) cycles += core.executeInstruction();
  return { bits: registers[0] >>> 0, cycles };
}

const bits = new Uint32Array(1);
const float = new Float32Array(bits.buffer);
const toFloat = (value) => ((bits[0] = value), float[0]);
const toBits = (value) => ((float[0] = value), bits[0]);

let state = 0x12345678;
/** A random word. */
function random() {
  state ^= state << 13;
  state ^= state >>> 17;
  state ^= state << 5;
  return state >>> 0;
}

const EDGES = [
  0, 1, 0x00400000, 0x007fffff, 0x00800000, 0x00800001, 0x33800000, 0x3f7fffff, 0x3f800000, 0x3f800001, 0x4b800000, 0x7f7fffff, 0x7f800000,
  0x7fc00000,
];
const signed = EDGES.flatMap((value) => [value, (value | 0x80000000) >>> 0]);
const pairs = signed.flatMap((a) => signed.map((b) => [a, b]));
for (let number = 0; number < options.pairs; number += 1) {
  const [a, b] = [random(), random()];
  const EXPONENT = 0x7f800000;
  // Any; exponents that are near; few bits, whose products are halfway between two numbers; products near the limits.
  const near = (a + ((b >>> 27) << 23)) & EXPONENT;
  const pair = [
    [a, b],
    [a, (b & ~EXPONENT) | near],
    [a & 0xfffff000, (b & ~EXPONENT & 0xfffff000) | near],
    [a, (b & ~EXPONENT) | ((((number & 8 ? 0xfe : 0x80) << 23) - (a & EXPONENT) + ((b >>> 30) << 23)) & EXPONENT)],
  ][number & 3];
  pairs.push(pair.map((value) => value >>> 0));
}

const addresses = functions(readFileSync(options.elf));
const report = {};
for (const [name, expected] of [
  ['__aeabi_fmul', (a, b) => a * b],
  ['__aeabi_fadd', (a, b) => a + b],
  ['__aeabi_fsub', (a, b) => a - b],
]) {
  let cycles = 0;
  for (const [a, b] of pairs) {
    const found = call(addresses[name], a, b);
    cycles += found.cycles;
    const value = Math.fround(expected(toFloat(a), toFloat(b)));
    const isSame = Number.isNaN(value) ? Number.isNaN(toFloat(found.bits)) : found.bits === toBits(value);
    if (!isSame) throw new Error(`${name}(${a.toString(16)}, ${b.toString(16)}) is ${found.bits.toString(16)}, not ${toBits(value).toString(16)}`);
  }
  report[name] = { pairs: pairs.length, meanCycles: cycles / pairs.length };
}
console.log(JSON.stringify(report, null, 2));
