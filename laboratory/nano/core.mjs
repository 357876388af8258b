// The instructions that programs use most, ahead of rp2040js's chain of comparisons, which decodes all others; and
// carries into the sign, which it has wrong.

const PC = 15;
const SP = 13;

/** Makes `core` execute them here. Cycles are rp2040js's. */
export function speedUp(core, chip) {
  const decode = core.executeInstruction.bind(core);
  const { registers } = core;
  const { flash16 } = chip;
  const { buffer, byteOffset, length } = chip.sram;
  const ram16 = new Uint16Array(buffer, byteOffset, length / 2);

  const setNZ = (result) => {
    core.N = result < 0;
    core.Z = result === 0;
    return result;
  };
  /** Adds with a carry; a subtraction adds the complement. */
  const add = (a, b, carry) => {
    const sum = a + b + carry;
    const result = sum | 0;
    core.C = sum > 0xffffffff;
    core.V = ((a ^ result) & (b ^ result)) < 0;
    return setNZ(result);
  };
  const subtract = (a, b) => add(a, ~b >>> 0, 1);
  const load = (rt, address) => {
    registers[rt] = chip.readUint32(address);
    return 1 + core.cyclesIO(address);
  };
  const store = (address, rt) => {
    chip.writeUint32(address, registers[rt]);
    return 1 + core.cyclesIO(address, true);
  };

  core.executeInstruction = () => {
    const pc = registers[PC];
    const region = pc >>> 24;
    if (core.interruptsUpdated || (region !== 0x20 && region !== 0x10)) return decode();
    const opcode = (region === 0x20 ? ram16 : flash16)[(pc & 0xffffff) >> 1];
    const low = opcode & 7;
    const middle = (opcode >> 3) & 7;
    const high = (opcode >> 8) & 7;
    const imm5 = (opcode >> 6) & 31;
    const imm8 = opcode & 0xff;
    let cycles = 1;
    switch (opcode >> 11) {
      case 0b00000: // LSLS
        if (imm5) core.C = ((registers[middle] >>> (32 - imm5)) & 1) === 1;
        registers[low] = setNZ(registers[middle] << imm5);
        break;
      case 0b00001: { // LSRS
        const value = registers[middle];
        core.C = ((value >>> ((imm5 || 32) - 1)) & 1) === 1;
        registers[low] = setNZ(imm5 ? (value >>> imm5) | 0 : 0);
        break;
      }
      case 0b00011: { // ADDS, SUBS
        const b = opcode & 0x400 ? imm5 & 7 : registers[imm5 & 7];
        registers[low] = opcode & 0x200 ? subtract(registers[middle], b) : add(registers[middle], b, 0);
        break;
      }
      case 0b00100: // MOVS
        registers[high] = setNZ(imm8);
        break;
      case 0b00101: // CMP
        subtract(registers[high], imm8);
        break;
      case 0b00110: // ADDS
        registers[high] = add(registers[high], imm8, 0);
        break;
      case 0b00111: // SUBS
        registers[high] = subtract(registers[high], imm8);
        break;
      case 0b01000: {
        const a = registers[low];
        const b = registers[middle];
        switch (opcode >> 6) {
          case 0b0100000000: // ANDS
            registers[low] = setNZ(a & b);
            break;
          case 0b0100000001: // EORS
            registers[low] = setNZ(a ^ b);
            break;
          case 0b0100000101: // ADCS
            registers[low] = add(a, b, core.C ? 1 : 0);
            break;
          case 0b0100000110: // SBCS
            registers[low] = add(a, ~b >>> 0, core.C ? 1 : 0);
            break;
          case 0b0100001000: // TST
            setNZ(a & b);
            break;
          case 0b0100001010: // CMP
            subtract(a, b);
            break;
          case 0b0100001100: // ORRS
            registers[low] = setNZ(a | b);
            break;
          case 0b0100001101: // MULS
            registers[low] = setNZ(Math.imul(a, b));
            break;
          default:
            return decode();
        }
        break;
      }
      case 0b01001: // LDR, literal
        cycles = load(high, ((pc + 4) & ~3) + 4 * imm8);
        break;
      case 0b01100: // STR
        cycles = store(registers[middle] + 4 * imm5, low);
        break;
      case 0b01101: // LDR
        cycles = load(low, registers[middle] + 4 * imm5);
        break;
      case 0b10010: // STR, from SP
        cycles = store(registers[SP] + 4 * imm8, high);
        break;
      case 0b10011: // LDR, from SP
        cycles = load(high, registers[SP] + 4 * imm8);
        break;
      case 0b11010:
      case 0b11011: { // B, with a condition
        const condition = (opcode >> 8) & 15;
        if (condition >= 14) return decode();
        registers[PC] = pc + 2;
        if (core.checkCondition(condition)) {
          registers[PC] = pc + 4 + ((opcode << 24) >> 23);
          cycles = 2;
        }
        core.cycles += cycles;
        return cycles;
      }
      case 0b11100: // B
        registers[PC] = pc + 4 + ((opcode << 21) >> 20);
        core.cycles += 2;
        return 2;
      default:
        return decode();
    }
    registers[PC] = pc + 2;
    core.cycles += cycles;
    return cycles;
  };
}
