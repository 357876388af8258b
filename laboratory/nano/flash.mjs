// The flash chip behind the SSI. The board was built with two kinds. They differ here only where the second boot stage sees
// a difference. Erase and program are functions of the boot ROM: see rom.mjs.

// Bit of the first status register of both kinds.
const BUSY = 0;

// By kind: the answer to each command, and the mode bits after a quad read's address that keep the chip in reads without a
// command. Both have had their quad enable bit set in production, which no power cycle clears (raspberrypi/pico-sdk#537).
const KINDS = {
  // Mode bits 5 and 4 count; status register 2 has quad enable in bit 1, and is written by 31h (DS-AT25SF128A).
  at25sf128a: {
    identity: [0x1f, 0x89, 0x01],
    registers: { 0x05: BUSY, 0x35: 0x02 },
    continues: (mode) => (mode & 0x30) === 0x20,
  },
  // Mode bits 7 to 4 have to be 1010; quad enable is bit 6 of the only status register, 35h reads nothing, 31h is unknown,
  // and 01h with two bytes is ignored (DS-IS25LP128F).
  is25lp128f: {
    identity: [0x9d, 0x60, 0x18],
    registers: { 0x05: 0x40 | BUSY },
    continues: (mode) => (mode & 0xf0) === 0xa0,
  },
};

const READ_IDENTITY = 0x9f;
const READ_UNIQUE_ID = 0x4b;
const QUAD_READ = 0xeb;

export class FlashChip {
  /** Whether reads of the flash's address range are answered. */
  isMapped = false;
  noise = 1;

  constructor(kind, uniqueId) {
    this.kind = KINDS[kind];
    if (!this.kind) throw new Error(`no flash chip ${kind}: ${Object.keys(KINDS).join(', ')}`);
    this.uniqueId = uniqueId;
  }

  /** Bytes that the chip sends after a command. An unknown command reads as ones. */
  answer(command) {
    const { identity, registers } = this.kind;
    if (command === READ_IDENTITY) return identity;
    if (command === READ_UNIQUE_ID) return [0, 0, 0, 0, ...this.uniqueId];
    if (command in registers) return [registers[command]];
    return [0xff];
  }

  /** A byte of an output that floats, which can be any. */
  floating() {
    this.noise = (Math.imul(this.noise, 1_664_525) + 1_013_904_223) >>> 0;
    return this.noise >>> 24;
  }

  /** A quad read starts, with mode bits after its address. */
  start(command, mode) {
    this.continues = command === QUAD_READ && this.kind.continues(mode);
  }

  /** The SSI is set up to read without commands, and to send these mode bits after each address. */
  map(mode) {
    this.isMapped = this.continues && this.kind.continues(mode);
  }

  /** Leaves reads without a command, as the boot ROM does before it sends others. */
  exit() {
    this.continues = this.isMapped = false;
  }
}
