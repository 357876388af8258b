// Flash images: UF2 files, or raw bytes from the start of flash.

const FLASH = 0x10000000;
const SECTOR = 4096;
const RP2040_FAMILY = 0xe48bff56;
const NOT_MAIN_FLASH = 0x1;
const HAS_FAMILY = 0x2000;

/** Writes an image into `flash` as the boot loader does: it erases the sectors it touches, and no others. */
export function load(image, flash) {
  const erased = new Set();
  for (const [offset, data] of blocks(image)) {
    for (let sector = offset - (offset % SECTOR); sector < offset + data.length; sector += SECTOR) {
      if (!erased.has(sector)) flash.fill(0xff, sector, sector + SECTOR);
      erased.add(sector);
    }
    flash.set(data, offset);
  }
}

function blocks(image) {
  const words = new DataView(image.buffer, image.byteOffset, image.length);
  if (image.length < 512 || words.getUint32(0, true) !== 0x0a324655) return [[0, image]];
  const found = [];
  for (let at = 0; at < image.length; at += 512) {
    const [magic, magic2, flags, address, size, number, count, family] = [...Array(8).keys()].map((i) =>
      words.getUint32(at + 4 * i, true),
    );
    if (magic !== 0x0a324655 || magic2 !== 0x9e5d5157 || words.getUint32(at + 508, true) !== 0x0ab16f30)
      throw new Error(`block ${at / 512} of the UF2 file is damaged`);
    if (flags & NOT_MAIN_FLASH || !(flags & HAS_FAMILY) || family !== RP2040_FAMILY) continue;
    // The boot ROM starts the program only after it has received all blocks.
    if (number !== found.length || count * 512 > image.length) throw new Error('the UF2 file is not complete');
    found.push([address - FLASH, image.subarray(at + 32, at + 32 + size)]);
  }
  if (!found.length) throw new Error('the UF2 file has no block for an RP2040');
  return found;
}
