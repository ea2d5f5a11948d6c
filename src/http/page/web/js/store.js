// One object of state, and whoever wants to know when it changes.

/**
 * @template {object} T
 * @typedef {object} Store
 * @property {() => T} get The state as it is.
 * @property {(change: Partial<T>) => void} set Changes members; listeners hear of it once, after the running task.
 * @property {(listener: () => void) => void} on Calls the listener after every change.
 */

/**
 * @template {object} T
 * @param {T} initial
 * @returns {Store<T>}
 */
export function createStore(initial) {
  let state = initial;
  let announced = false;
  /** @type {(() => void)[]} */
  const listeners = [];
  const announce = () => {
    announced = false;
    for (const listener of listeners) listener();
  };
  return {
    get: () => state,
    set(change) {
      state = { ...state, ...change };
      if (announced) return;
      announced = true;
      queueMicrotask(announce);
    },
    on: (listener) => void listeners.push(listener),
  };
}
