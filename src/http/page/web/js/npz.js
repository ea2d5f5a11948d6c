// Reads NumPy archives into typed arrays. The browser decompresses them.

/** @typedef {Float64Array | Float32Array | Int32Array | Uint32Array | Int8Array | Uint8Array} Values */
/** @typedef {{ shape: number[], values: Values }} NamedArray */

const END_OF_DIRECTORY = 0x06054b50;
const STORED = 0;

/**
 * @param {ArrayBuffer} archive
 * @returns {Promise<Record<string, NamedArray>>}
 * @throws {Error} If the archive is broken or has an unsupported number type.
 */
export async function readNpz(archive) {
  const view = new DataView(archive);
  let end = archive.byteLength - 22;
  while (end >= 0 && view.getUint32(end, true) !== END_OF_DIRECTORY) end -= 1;
  if (end < 0) throw new Error('no archive: its directory is missing');
  let entry = view.getUint32(end + 16, true);
  /** @type {Record<string, NamedArray>} */
  const arrays = {};
  for (let left = view.getUint16(end + 10, true); left > 0; left -= 1) {
    const method = view.getUint16(entry + 10, true);
    const size = view.getUint32(entry + 20, true);
    const nameLength = view.getUint16(entry + 28, true);
    const local = view.getUint32(entry + 42, true);
    const name = new TextDecoder().decode(new Uint8Array(archive, entry + 46, nameLength));
    const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
    const packed = new Uint8Array(archive, start, size);
    const plain = method === STORED ? packed.slice().buffer : await inflate(packed);
    arrays[name.replace(/\.npy$/, '')] = readNpy(plain);
    entry += 46 + nameLength + view.getUint16(entry + 30, true) + view.getUint16(entry + 32, true);
  }
  return arrays;
}

/** @param {Uint8Array<ArrayBuffer>} packed */
function inflate(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return new Response(stream).arrayBuffer();
}

/**
 * @param {ArrayBuffer} file
 * @returns {NamedArray}
 */
function readNpy(file) {
  const view = new DataView(file);
  const long = view.getUint8(6) > 1;
  const start = (long ? 12 : 10) + (long ? view.getUint32(8, true) : view.getUint16(8, true));
  const head = new TextDecoder().decode(new Uint8Array(file, 0, start));
  const kind = /'descr': '([^']+)'/.exec(head)?.[1] ?? '';
  const shape = (/'shape': \(([^)]*)\)/.exec(head)?.[1] ?? '').split(',').filter((part) => part.trim()).map(Number);
  return { shape, values: valuesOf(kind, file.slice(start)) };
}

/**
 * @param {string} kind
 * @param {ArrayBuffer} raw
 * @returns {Values}
 */
function valuesOf(kind, raw) {
  if (kind === '<f8') return new Float64Array(raw);
  if (kind === '<f4') return new Float32Array(raw);
  if (kind === '<i4') return new Int32Array(raw);
  if (kind === '<u4') return new Uint32Array(raw);
  if (kind === '|i1') return new Int8Array(raw);
  if (kind === '|u1') return new Uint8Array(raw);
  throw new Error(`numbers of the kind ${kind} cannot be read`);
}
