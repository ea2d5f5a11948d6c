// Server-sent events over `fetch`, because `EventSource` cannot send an API key.

import { Refused, request } from './api.js';

const FIRST_PAUSE_MS = 500;
const LONGEST_PAUSE_MS = 15_000;

/** @typedef {{ id: string, event: string, data: string }} ServerEvent */

/**
 * Creates a parser for a stream of events that arrives in arbitrary pieces.
 * @returns {(piece: string) => ServerEvent[]} Parses the next piece and returns the events that it completes.
 */
export function eventReader() {
  let rest = '';
  return (piece) => {
    const blocks = (rest + piece).split('\n\n');
    rest = blocks.pop() ?? '';
    return blocks.map(readEvent).filter((event) => event.data !== '');
  };
}

/** @param {string} block */
function readEvent(block) {
  /** @type {ServerEvent} */
  const event = { id: '', event: 'message', data: '' };
  for (const line of block.split('\n')) {
    const colon = line.indexOf(':');
    const name = colon < 0 ? line : line.slice(0, colon);
    const value = colon < 0 ? '' : line.slice(colon + 1).replace(/^ /, '');
    if (name === 'data') event.data += event.data ? `\n${value}` : value;
    else if (name === 'id') event.id = value;
    else if (name === 'event') event.event = value;
  }
  return event;
}

/**
 * Follows a stream of events until it ends or `signal` aborts. Reconnects after a broken connection, with increasing pauses.
 * @param {string} path
 * @param {(event: ServerEvent) => boolean | void} take Handles an event. Returning true ends the stream.
 * @param {AbortSignal} signal
 * @throws {Refused} If the service rejects the stream with a client error other than 429.
 */
export async function follow(path, take, signal) {
  let last = '';
  let pause = FIRST_PAUSE_MS;
  while (!signal.aborted) {
    try {
      const headers = { Accept: 'text/event-stream', ...(last ? { 'Last-Event-ID': last } : {}) };
      const answer = await request(path, { headers, signal });
      if (answer.status === 204 || !answer.body) return;
      const read = eventReader();
      const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
      for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
        for (const event of read(piece.value)) {
          last = event.id || last;
          pause = FIRST_PAUSE_MS;
          if (take(event)) return void reader.cancel();
        }
      }
    } catch (error) {
      if (signal.aborted) return;
      const status = error instanceof Refused ? error.status : 0;
      if (status >= 400 && status < 500 && status !== 429) throw error;
    }
    await rest(pause, signal);
    pause = Math.min(2 * pause, LONGEST_PAUSE_MS);
  }
}

/**
 * @param {number} milliseconds
 * @param {AbortSignal} signal
 * @returns {Promise<void>}
 */
function rest(milliseconds, signal) {
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, milliseconds);
    signal.addEventListener('abort', () => {
      clearTimeout(timer);
      resolve();
    });
  });
}
