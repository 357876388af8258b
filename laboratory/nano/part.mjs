// The sensor: a child process with the simulated part, asked over two FIFOs, so that answers can be waited for
// without an event loop.

import { execFileSync, spawn } from 'node:child_process';
import { closeSync, mkdtempSync, openSync, readSync, rmSync, writeSync } from 'node:fs';
import { availableParallelism, tmpdir } from 'node:os';
import { join } from 'node:path';

const NEVER = 0xffffffffffffffffn;

export class Part {
  constructor(program, motion, seed) {
    shareProcessor();
    const folder = mkdtempSync(join(tmpdir(), 'part-'));
    const [questions, answers] = ['questions', 'answers'].map((name) => join(folder, name));
    execFileSync('mkfifo', [questions, answers]);
    const script = 'exec "$0" "$1" "$2" <"$3" >"$4"';
    spawn('sh', ['-c', script, program, motion, String(seed), questions, answers], { stdio: ['ignore', 'ignore', 'inherit'] });
    this.to = openSync(questions, 'w');
    this.from = openSync(answers, 'r');
    rmSync(folder, { recursive: true });
  }

  /** Writes a register's address, and values from there on. Returns whether the part acknowledges. */
  write(ns, bytes) {
    return this.ask('w', ns, bytes.length, 0, bytes)[0] === 1;
  }

  /** Reads bytes from the address on; null without acknowledge. */
  read(ns, count) {
    const [acknowledged, ...bytes] = this.ask('r', ns, count, count);
    return acknowledged ? bytes : null;
  }

  /** Level of INT1, and the time of its next rising edge, Infinity without one. */
  int1(ns) {
    const answer = this.ask('e', ns, 0, 8);
    const next = answer.readBigUInt64LE(1);
    return { high: answer[0] === 1, next: next === NEVER ? Infinity : Number(next) };
  }

  /** Injects a fault by its name in the program `part`; `clear` removes all. */
  inject(ns, fault) {
    const name = Buffer.from(fault);
    if (!this.ask('f', ns, name.length, 0, name)[0]) throw new Error(`the part has no fault ${fault}`);
  }

  ask(operation, ns, count, answers, data = []) {
    const question = Buffer.alloc(10 + data.length);
    question.write(operation);
    question[1] = count;
    question.writeBigUInt64LE(BigInt(Math.round(ns)), 2);
    question.set(data, 10);
    writeSync(this.to, question);
    const answer = Buffer.alloc(1 + answers);
    for (let got = 0; got < answer.length; ) {
      const length = readSync(this.from, answer, got, answer.length - got);
      if (!length) throw new Error('the program of the part has ended');
      got += length;
    }
    return answer;
  }

  close() {
    closeSync(this.to);
    closeSync(this.from);
  }
}

/** Keeps both processes on one processor if `taskset` is available. They take turns, and answers come several times sooner. */
function shareProcessor() {
  const processor = process.pid % availableParallelism();
  try {
    execFileSync('taskset', ['-pc', String(processor), String(process.pid)], { stdio: 'ignore' });
  } catch {
    // Slower, and otherwise the same.
  }
}
