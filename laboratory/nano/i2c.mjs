// The I2C controller with the sensor on its wires.

import { I2CMode, RPI2C } from 'rp2040js';

const IC_INTR_MASK = 0x30;
const IC_CLR_INTR = 0x40;
const IC_CLR_TX_ABRT = 0x54;
const IC_DATA_CMD = 0x10;
const IC_RX_TL = 0x38;
const IC_TX_TL = 0x3c;
const IC_ENABLE = 0x6c;
const RX_FULL = 1 << 2;
const TX_EMPTY = 1 << 4;
const TX_ABRT = 1 << 6;

/** rp2040js completes transfers at once, does not let interrupts be enabled, and holds levels as events. */
export class I2c extends RPI2C {
  constructor(chip, name, irq, wires) {
    super(chip, name, irq);
    this.wires = wires;
    this.alarm = chip.clock.createAlarm(() => this.resume());
    this.onStart = () => this.after(1, () => this.completeStart());
    this.onConnect = (address, mode) =>
      this.after(9, () => this.completeConnect(wires.connect(address, mode === I2CMode.Read)));
    this.onWriteByte = (value) => this.after(9, () => this.completeWrite(wires.write(value)));
    this.onReadByte = () => this.after(9, () => this.completeRead(wires.read()));
    this.onStop = () =>
      this.after(1, () => {
        wires.stop();
        this.completeStop();
      });
  }

  /** Does `action` after some clocks, as long as nothing holds SDA. */
  after(bits, action) {
    this.action = action;
    this.alarm.schedule((bits * (this.sclLowPeriod + this.sclHighPeriod) * 1e9) / this.rp2040.clkSys);
  }

  /** Goes on, unless SDA is held low: then when it is released. */
  resume() {
    if (this.wires.stuck || !this.action) return;
    const { action } = this;
    this.action = null;
    action();
    this.checkInterrupts();
  }

  /** Forgets the transfer, as a reset of the controller does. */
  cancel() {
    this.alarm.cancel();
    if (this.action) this.wires.stop();
    this.action = null;
    this.state = 0;
    this.busy = this.stop = this.pendingRestart = false;
    this.txFIFO.reset();
    this.rxFIFO.reset();
    this.intRaw = 0;
    this.abortSource = 0;
    this.checkInterrupts();
  }

  // These two follow the levels of the FIFOs.
  get intStatus() {
    const full = this.rxFIFO.itemCount > this.rxThreshold ? RX_FULL : 0;
    const empty = this.enable & 1 && this.txFIFO.itemCount <= this.txThreshold ? TX_EMPTY : 0;
    return ((this.intRaw & ~(RX_FULL | TX_EMPTY)) | full | empty) & this.intEnable;
  }

  readUint32(offset) {
    const value = super.readUint32(offset);
    if (offset === IC_DATA_CMD || offset === IC_CLR_INTR || offset === IC_CLR_TX_ABRT) this.checkInterrupts();
    return value;
  }

  writeUint32(offset, value) {
    if (offset === IC_INTR_MASK) this.intEnable = value & 0x1fff;
    // The transmit FIFO is held empty from an abort until it is cleared.
    else if (offset === IC_DATA_CMD && this.intRaw & TX_ABRT) return;
    else {
      if (offset === IC_ENABLE && !(value & 1) && this.enable & 1) this.cancel();
      super.writeUint32(offset, value);
    }
    if ([IC_INTR_MASK, IC_DATA_CMD, IC_ENABLE, IC_RX_TL, IC_TX_TL].includes(offset)) this.checkInterrupts();
  }
}
