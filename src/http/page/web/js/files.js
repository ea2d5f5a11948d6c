// Detection of the encoding, format and body of dropped files. The service parses their contents.

/** @typedef {'simpack' | 'miniprof' | 'columns'} ProfileFormat */
/** @typedef {'rail' | 'wheel'} Body */
/** @typedef {{ name: string, text: string }} DroppedFile */

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
 * Returns the format of a file by its keywords or else its extension, and its body by its keywords or else its name. The body is null if
 * neither identifies it.
 * @param {DroppedFile} file
 * @returns {{ format: ProfileFormat, body: Body | null }}
 */
export function profileKind({ name, text }) {
  const end = name.toLowerCase().split('.').pop() ?? '';
  /** @type {Record<string, Body>} */
  const ends = { ban: 'rail', prr: 'rail', whl: 'wheel', prw: 'wheel' };
  const named = ends[end] ?? (/rail/i.test(name) ? 'rail' : /wheel/i.test(name) ? 'wheel' : null);
  if (/^\s*(point|spline)\.begin\b/im.test(text)) {
    const type = /header\.begin[^]*?^\s*type\s*=\s*([01])[^]*?header\.end/im.exec(text)?.[1];
    return { format: 'simpack', body: type === '0' ? 'rail' : type === '1' ? 'wheel' : named };
  }
  const old = /^\s*#MINI(WHEEL|RAIL)PROF/i.exec(text)?.[1].toLowerCase();
  if (old || /^\s*(ColumnDef|XYPoints|MINIPROF)\b/im.test(text)) {
    return { format: 'miniprof', body: old === 'wheel' ? 'wheel' : old === 'rail' ? 'rail' : named };
  }
  const format = end === 'ban' || end === 'whl' ? 'miniprof' : end === 'prr' || end === 'prw' ? 'simpack' : 'columns';
  return { format, body: named };
}

/**
 * Assigns files to bodies. Two files become one body each. A single file becomes the body of its keywords or format, else the one that it was
 * dropped on, else the one in its name, else the missing one.
 * @param {readonly DroppedFile[]} files
 * @param {readonly Body[]} missing Bodies of the case without a cross-section.
 * @param {Body} [onto] The body on whose area it was dropped.
 * @returns {Partial<Record<Body, DroppedFile>> | string} The files by body, or the reason why they cannot be assigned.
 */
export function bodiesOf(files, missing, onto) {
  const kinds = files.map(profileKind);
  if (files.length > 2) return `${files.length} files were dropped. Drop one rail and one wheel.`;
  if (files.length === 2) {
    const [one, two] = kinds.map(({ body }) => body);
    if (one && one === two) return `${files[0].name} and ${files[1].name} are both a ${one}. Drop one rail and one wheel.`;
    const turned = one === 'wheel' || two === 'rail';
    return turned ? { rail: files[1], wheel: files[0] } : { rail: files[0], wheel: files[1] };
  }
  // Keywords and extensions of formats take precedence over the drop area; a word in the name of a plain table does not.
  const certain = kinds[0].format === 'columns' ? null : kinds[0].body;
  const body = certain ?? onto ?? kinds[0].body ?? missing[0];
  return body ? { [body]: files[0] } : `${files[0].name} does not say whether it is a rail or a wheel. Drop it on one of the two.`;
}
