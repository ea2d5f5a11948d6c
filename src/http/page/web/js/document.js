// Access to a case as a JSON document: values by JSON pointer (RFC 6901), and formatted text.

/** @typedef {null | boolean | number | string | JsonList | JsonObject} JsonValue */
/** @typedef {JsonValue[]} JsonList */
/** @typedef {{ [key: string]: JsonValue }} JsonObject */

const LINE_LENGTH = 54;

/** @param {string} pointer */
const keysOf = (pointer) =>
  pointer.split('/').slice(1).map((key) => key.replaceAll('~1', '/').replaceAll('~0', '~'));

/** @param {string} key */
export const escapeKey = (key) => key.replaceAll('~', '~0').replaceAll('/', '~1');

/**
 * @param {unknown} value
 * @returns {value is JsonObject}
 */
export const isObject = (value) => typeof value === 'object' && value !== null && !Array.isArray(value);

/**
 * Returns the value at a pointer; undefined if there is none.
 * @param {JsonValue | undefined} document
 * @param {string} pointer
 * @returns {JsonValue | undefined}
 */
export function at(document, pointer) {
  /** @type {JsonValue | undefined} */
  let value = document;
  for (const key of keysOf(pointer)) {
    if (Array.isArray(value)) value = value[Number(key)];
    else if (isObject(value)) value = value[key];
    else return undefined;
  }
  return value;
}

/**
 * Returns the number at a pointer; NaN if there is none.
 * @param {JsonValue | undefined} document
 * @param {string} pointer
 */
export function numberAt(document, pointer) {
  const value = at(document, pointer);
  return typeof value === 'number' ? value : NaN;
}

/**
 * Returns the numbers of the list at a pointer; an empty list if there is none.
 * @param {JsonValue | undefined} document
 * @param {string} pointer
 */
export function numbersAt(document, pointer) {
  const value = at(document, pointer);
  return Array.isArray(value) ? value.map((item) => (typeof item === 'number' ? item : NaN)) : [];
}

/**
 * Returns a copy with one value replaced; undefined removes it. Missing parent objects are created.
 * @param {JsonValue | undefined} document
 * @param {string} pointer
 * @param {JsonValue | undefined} value
 * @returns {JsonObject}
 */
export function put(document, pointer, value) {
  const keys = keysOf(pointer);
  /** @type {(part: JsonValue | undefined, depth: number) => JsonValue} */
  const changed = (part, depth) => {
    const key = keys[depth];
    const last = depth === keys.length - 1;
    if (Array.isArray(part)) {
      const list = part.slice();
      list[Number(key)] = last ? (value ?? null) : changed(list[Number(key)], depth + 1);
      return list;
    }
    const object = isObject(part) ? { ...part } : {};
    if (!last) object[key] = changed(object[key], depth + 1);
    else if (value === undefined) delete object[key];
    else object[key] = value;
    return object;
  };
  return /** @type {JsonObject} */ (changed(isObject(document) ? document : {}, 0));
}

/**
 * Formats JSON for reading: short lists and objects on one line, long lists wrapped.
 * @param {JsonValue} value
 * @returns {string}
 */
export function pretty(value, indent = '') {
  if (typeof value !== 'object' || value === null) return JSON.stringify(value);
  const inner = `${indent}  `;
  if (Array.isArray(value)) {
    if (!value.length) return '[]';
    if (value.every((item) => !isObject(item) && !(Array.isArray(item) && item.length > 4))) {
      const items = value.map((item) => JSON.stringify(item).replaceAll(',', ', '));
      const line = `[${items.join(', ')}]`;
      return line.length + indent.length <= LINE_LENGTH ? line : `[\n${filled(items, inner)}\n${indent}]`;
    }
    return `[\n${value.map((item) => inner + pretty(item, inner)).join(',\n')}\n${indent}]`;
  }
  const members = Object.entries(value);
  if (!members.length) return '{}';
  const simple = members.every(([, item]) => typeof item !== 'object' || item === null);
  const line = `{ ${members.map(([key, item]) => `${JSON.stringify(key)}: ${JSON.stringify(item)}`).join(', ')} }`;
  if (simple && indent && line.length + indent.length <= LINE_LENGTH) return line;
  const lines = members.map(([key, item]) => `${inner}${JSON.stringify(key)}: ${pretty(item, inner)}`);
  return `{\n${lines.join(',\n')}\n${indent}}`;
}

/**
 * Joins items into wrapped lines.
 * @param {string[]} items
 * @param {string} indent
 */
function filled(items, indent) {
  const room = Math.max(32, LINE_LENGTH - indent.length);
  const lines = [];
  let line = '';
  items.forEach((item, place) => {
    const text = place < items.length - 1 ? `${item},` : item;
    if (line && line.length + text.length + 1 > room) {
      lines.push(indent + line);
      line = '';
    }
    line += line ? ` ${text}` : text;
  });
  lines.push(indent + line);
  return lines.join('\n');
}

/**
 * Returns the pointers at which two documents differ. A long list counts as one value.
 * @param {JsonValue | undefined} one
 * @param {JsonValue | undefined} other
 * @returns {string[]} Pointers.
 */
export function differences(one, other, pointer = '') {
  if (JSON.stringify(one) === JSON.stringify(other)) return [];
  if (isObject(one) && isObject(other)) {
    const keys = [...new Set([...Object.keys(one), ...Object.keys(other)])];
    return keys.flatMap((key) => differences(one[key], other[key], `${pointer}/${escapeKey(key)}`));
  }
  const short = (/** @type {JsonValue | undefined} */ list) => Array.isArray(list) && list.length <= 12;
  if (Array.isArray(one) && Array.isArray(other) && short(one) && short(other)) {
    const places = [...Array(Math.max(one.length, other.length)).keys()];
    return places.flatMap((place) => differences(one[place], other[place], `${pointer}/${place}`));
  }
  return [pointer];
}

/**
 * Returns the range of the key of a pointer in a text; null if it is not found.
 * @param {string} text JSON
 * @param {string} pointer
 * @returns {[number, number] | null}
 */
export function placeInText(text, pointer) {
  /** @type {[number, number] | null} */
  let found = null;
  let from = 0;
  for (const key of keysOf(pointer)) {
    const name = JSON.stringify(key);
    const start = text.indexOf(`${name}:`, from);
    if (start < 0) continue;
    found = [start, start + name.length];
    from = start + name.length;
  }
  return found;
}
