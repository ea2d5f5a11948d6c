// Tests events that arrive in pieces, and archives of arrays.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { deflateRawSync } from 'node:zlib';
import { readNpz } from '../../../src/http/page/web/js/npz.js';

// The page keeps its key in the storage of the browser.
Object.assign(globalThis, { sessionStorage: { getItem: () => null, setItem() {} } });
const { eventReader } = await import('../../../src/http/page/web/js/events.js');

const STREAM = ': remark\n\nevent: state\nid: 3\nretry: 1000\ndata: {"a":1}\n\nid: 4\ndata: one\ndata: two\n\n';

test('events are the same wherever the stream is cut', () => {
  const whole = eventReader()(STREAM);
  assert.deepEqual(whole, [{ id: '3', event: 'state', data: '{"a":1}' }, { id: '4', event: 'message', data: 'one\ntwo' }]);
  for (let cut = 0; cut <= STREAM.length; cut += 1) {
    const read = eventReader();
    assert.deepEqual([...read(STREAM.slice(0, cut)), ...read(STREAM.slice(cut))], whole, `cut at ${cut}`);
  }
});

/** A file of NumPy. @param {string} kind @param {string} shape @param {Buffer} data */
function npy(kind, shape, data) {
  const head = `{'descr': '${kind}', 'fortran_order': False, 'shape': ${shape}, }`;
  const text = `${head.padEnd(117)}\n`;
  return Buffer.concat([Buffer.from('\x93NUMPY\x01\x00', 'latin1'), Buffer.from([text.length & 255, text.length >> 8]), Buffer.from(text), data]);
}

/** An archive with these files, the first one packed. @param {[string, Buffer][]} files */
function zip(files) {
  const parts = [];
  const entries = [];
  let at = 0;
  for (const [place, [name, body]] of files.entries()) {
    const packed = place === 0 ? deflateRawSync(body) : body;
    const local = Buffer.alloc(30);
    local.writeUInt32LE(0x04034b50, 0);
    local.writeUInt16LE(name.length, 26);
    const entry = Buffer.alloc(46);
    entry.writeUInt32LE(0x02014b50, 0);
    entry.writeUInt16LE(place === 0 ? 8 : 0, 10);
    entry.writeUInt32LE(packed.length, 20);
    entry.writeUInt16LE(name.length, 28);
    entry.writeUInt32LE(at, 42);
    parts.push(local, Buffer.from(name), packed);
    entries.push(entry, Buffer.from(name));
    at += 30 + name.length + packed.length;
  }
  const end = Buffer.alloc(22);
  end.writeUInt32LE(0x06054b50, 0);
  end.writeUInt16LE(files.length, 10);
  end.writeUInt32LE(at, 16);
  const whole = Buffer.concat([...parts, ...entries, end]);
  return whole.buffer.slice(whole.byteOffset, whole.byteOffset + whole.length);
}

test('archives are read with their shapes and kinds of numbers', async () => {
  const arrays = await readNpz(zip([
    ['x_mm.npy', npy('<f8', '(2, 2)', Buffer.from(new Float64Array([1, 2, 3, 4.5]).buffer))],
    ['strip.npy', npy('<i4', '(3,)', Buffer.from(new Int32Array([0, 0, -7]).buffer))],
    ['p.npy', npy('<f4', '(1,)', Buffer.from(new Float32Array([0.5]).buffer))],
  ]));
  assert.deepEqual(arrays.x_mm, { shape: [2, 2], values: new Float64Array([1, 2, 3, 4.5]) });
  assert.deepEqual(arrays.strip, { shape: [3], values: new Int32Array([0, 0, -7]) });
  assert.deepEqual(arrays.p.values, new Float32Array([0.5]));
});

test('what is no archive is refused', async () => {
  await assert.rejects(readNpz(new ArrayBuffer(40)), /archive/);
  await assert.rejects(readNpz(zip([['a.npy', npy('<c16', '(1,)', Buffer.alloc(16))]])), /c16/);
});
