// Reading of dropped files, and detection of their encoding, format and body. The service parses their contents.

/** @typedef {'simpack' | 'miniprof' | 'columns'} ProfileFormat */
/** @typedef {'rail' | 'wheel'} Body */
/** @typedef {{ name: string, text: string }} DroppedFile */
/**
 * @typedef {object} ProfileKind
 * @property {ProfileFormat} format By the keywords of the file, or else its extension.
 * @property {Body | null} contents The body that the contents show; null if they do not.
 * @property {Body | null} named The body by the name of the file.
 */

/** Thrown for a file that cannot be used. The message is for the user. */
export class Unusable extends Error {}

/** Largest sizes of files in MiB. A case with two cross-sections must fit into a request. */
const PROFILE_MIB = 4;
export const TABLE_MIB = 64;
/** Control characters that no text contains. Some programs end a text with U+001A. */
const BINARY = /[\0-\x08\x0e-\x19\x1c-\x1f]/;

/**
 * Returns the text of a file.
 * @param {File} file
 * @param {number} [most] Largest size in MiB.
 * @throws {Unusable}
 */
export async function textOfFile(file, most = PROFILE_MIB) {
  const mebibytes = file.size / 2 ** 20;
  if (mebibytes > most) {
    const points = most === PROFILE_MIB ? ' A cross-section has at most 20 000 points: thin it out, or cut it to one rail or wheel.' : '';
    throw new Unusable(`${file.name} has ${mebibytes.toFixed(1)} MiB; at most ${most} MiB are read.${points}`);
  }
  const bytes = await file.arrayBuffer().catch(() => null);
  if (!bytes) throw new Unusable(`${file.name} cannot be read. Is it a folder?`);
  const text = decoded(bytes);
  if (BINARY.test(text)) throw new Unusable(`${file.name} is not a text file. Cross-sections are read from MiniProf, Simpack and CSV files, and from columns of numbers.`);
  return text;
}

/**
 * Decodes a file in UTF-8, UTF-16 or, as a fallback, Windows-1252.
 * @param {ArrayBuffer} buffer
 */
export function decoded(buffer) {
  const bytes = new Uint8Array(buffer);
  const marked = bytes[0] === 0xff && bytes[1] === 0xfe ? 'utf-16le' : bytes[0] === 0xfe && bytes[1] === 0xff ? 'utf-16be' : '';
  // In UTF-16 without a byte order mark, every other byte of ASCII text is 0.
  const unmarked = bytes[1] === 0 && bytes[3] === 0 ? 'utf-16le' : bytes[0] === 0 && bytes[2] === 0 ? 'utf-16be' : '';
  if (bytes.length > 3 && (marked || unmarked)) return new TextDecoder(marked || unmarked).decode(buffer);
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(buffer);
  } catch {
    return new TextDecoder('windows-1252').decode(buffer);
  }
}

/**
 * Returns the format of a file, and its body by keywords and by name.
 * @param {DroppedFile} file
 * @returns {ProfileKind}
 */
export function profileKind({ name, text }) {
  const end = name.toLowerCase().split('.').pop() ?? '';
  /** @type {Record<string, Body>} */
  const ends = { ban: 'rail', prr: 'rail', whl: 'wheel', prw: 'wheel' };
  const named = ends[end] ?? (/rail/i.test(name) ? 'rail' : /wheel/i.test(name) ? 'wheel' : null);
  if (/^\s*(point|spline)\.begin\b/im.test(text)) {
    const type = /header\.begin[^]*?^\s*type\s*=\s*([01])[^]*?header\.end/im.exec(text)?.[1];
    return { format: 'simpack', contents: type === '0' ? 'rail' : type === '1' ? 'wheel' : null, named };
  }
  const old = /^\s*#MINI(WHEEL|RAIL)PROF/i.exec(text)?.[1].toLowerCase();
  if (old || /^\s*(ColumnDef|XYPoints|MINIPROF)\b/im.test(text)) {
    return { format: 'miniprof', contents: old === 'wheel' ? 'wheel' : old === 'rail' ? 'rail' : null, named };
  }
  const format = end === 'ban' || end === 'whl' ? 'miniprof' : end === 'prr' || end === 'prw' ? 'simpack' : 'columns';
  return { format, contents: null, named };
}

/**
 * Assigns files to bodies. Two files become one body each. A single file becomes the body of its contents or format, else the one that it was
 * dropped on, else the one in its name, else the missing one.
 * @param {readonly DroppedFile[]} files
 * @param {readonly ProfileKind[]} kinds
 * @param {readonly Body[]} missing Bodies of the case without a cross-section.
 * @param {Body} [onto] The body on whose area it was dropped.
 * @returns {Partial<Record<Body, DroppedFile>> | string} The files by body, or the reason why they cannot be assigned.
 */
export function bodiesOf(files, kinds, missing, onto) {
  if (files.length > 2) return `${files.length} files were dropped. Drop one rail and one wheel.`;
  const shown = kinds.map(({ contents }) => contents);
  if (files.length === 2) {
    const [one, two] = shown.some(Boolean) ? shown : kinds.map(({ named }) => named);
    if (one && one === two) return `${files[0].name} and ${files[1].name} are both a ${one}. Drop one rail and one wheel.`;
    const turned = one === 'wheel' || two === 'rail';
    return turned ? { rail: files[1], wheel: files[0] } : { rail: files[0], wheel: files[1] };
  }
  // The extension of a format takes precedence over the drop area; a word in the name of a plain table does not.
  const [{ format, named }] = kinds;
  const body = shown[0] ?? (format === 'columns' ? onto ?? named : named ?? onto) ?? missing[0];
  return body ? { [body]: files[0] } : `${files[0].name} does not show whether it is a rail or a wheel. Drop it on one of the two.`;
}
