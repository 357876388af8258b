// A stand-in for the boot ROM, which is in no registry: the lookup at its well-known addresses, and functions whose
// work is done here. Each function is a stub that stores to its own word of the traps.

const TRAPS = 0x3f00;
const STUBS = 0x200;
const FUNCTION_TABLE = 0x100;
const DATA_TABLE = 0x1f0;
const FLASH_SIZE = 16 << 20;
const SECTOR = 4096;
const PAGE = 256;
const RAM = 0x20000000;
const SECOND_STAGE = 0x20041f00;
const SECOND_STAGE_SIZE = 256;
// Of the board's AT25SF128A, typical.
const ERASE_SECTOR_NS = 60e6;
const PROGRAM_PAGE_NS = 0.6e6;

// By the ROM's two-letter codes. Arguments are r0 to r3; a result goes to r0.
const functions = {
  lookup: (chip, [, code]) => stub(Object.keys(functions).indexOf(String.fromCharCode(code & 0xff, code >> 8))),
  IF: () => {},
  EX: (chip) => chip.flashChip.exit(),
  FC: () => {},
  CX: () => {},
  RE: (chip, [address, length]) => {
    checkRange(address, length, SECTOR);
    chip.flash.fill(0xff, address, address + length);
    chip.stall((length / SECTOR) * ERASE_SECTOR_NS);
    chip.flashLog.erased += length / SECTOR;
  },
  RP: (chip, [address, data, length]) => {
    checkRange(address, length, PAGE);
    // Programming clears bits, and sets none.
    for (let i = 0; i < length; i++) chip.flash[address + i] &= chip.readUint8(data + i);
    chip.stall((length / PAGE) * PROGRAM_PAGE_NS);
    chip.flashLog.programmed += length / PAGE;
  },
  C4: copy,
  MC: copy,
  S4: set,
  MS: set,
  UB: (chip, [activityPins, disabledInterfaces]) => chip.onUsbBoot({ activityPins, disabledInterfaces }),
};

function checkRange(address, length, unit) {
  if (address % unit || length % unit || address + length > FLASH_SIZE)
    throw new Error(`the firmware changes ${length} bytes of flash at 0x${address.toString(16)}`);
}

function copy(chip, [to, from, length]) {
  for (let i = 0; i < length; i++) chip.writeUint8(to + i, chip.readUint8(from + i));
}

function set(chip, [to, value, length]) {
  for (let i = 0; i < length; i++) chip.writeUint8(to + i, value & 0xff);
}

// Address of a function in Thumb code; 0 for one that does not exist.
const stub = (index) => (index < 0 ? 0 : (STUBS + 16 * index) | 1);

export function image() {
  const rom = new DataView(new ArrayBuffer(16384));
  // Magic, and version 3.
  [0x4d, 0x75, 0x01, 0x03].forEach((byte, i) => rom.setUint8(0x10 + i, byte));
  rom.setUint16(0x14, FUNCTION_TABLE, true);
  rom.setUint16(0x16, DATA_TABLE, true);
  rom.setUint16(0x18, stub(0), true);
  Object.keys(functions).forEach((code, index) => {
    if (index) {
      rom.setUint16(FUNCTION_TABLE + 4 * index - 4, code.charCodeAt(0) | (code.charCodeAt(1) << 8), true);
      rom.setUint16(FUNCTION_TABLE + 4 * index - 2, stub(index), true);
    }
    // push {r4}; ldr r4, trap; str r4, [r4]; pop {r4}; bx lr
    [0xb410, 0x4c02, 0x6024, 0xbc10, 0x4770].forEach((instruction, i) =>
      rom.setUint16(STUBS + 16 * index + 2 * i, instruction, true),
    );
    rom.setUint32(STUBS + 16 * index + 12, TRAPS + 4 * index, true);
  });
  return new Uint32Array(rom.buffer);
}

/**
 * Copies the second boot stage to the end of RAM and starts it, as the ROM does: it sets up reads from the flash, and jumps
 * to the program's vectors. Returns false where its checksum is wrong, as in a blank flash.
 */
export function loadSecondStage(chip) {
  const code = chip.flash.subarray(0, SECOND_STAGE_SIZE);
  const checksum = new DataView(code.buffer, code.byteOffset).getUint32(SECOND_STAGE_SIZE - 4, true);
  if (crc32(code.subarray(0, SECOND_STAGE_SIZE - 4)) !== checksum) return false;
  chip.sram.set(code, SECOND_STAGE - RAM);
  chip.core.SP = SECOND_STAGE;
  chip.core.LR = 0;
  chip.core.PC = SECOND_STAGE;
  return true;
}

/** CRC-32/MPEG-2. */
function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte << 24;
    for (let bit = 0; bit < 8; bit++) crc = crc & 0x80000000 ? (crc << 1) ^ 0x04c11db7 : crc << 1;
  }
  return crc >>> 0;
}

/** Does the work of a function, if a stub has stored to its trap. */
export function trap(chip, address) {
  const called = Object.values(functions)[(address - TRAPS) / 4];
  if (!called) return;
  const { registers } = chip.core;
  const result = called(chip, registers);
  if (result !== undefined) registers[0] = result;
}
