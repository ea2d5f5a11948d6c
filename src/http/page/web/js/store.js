// A state object with listeners for its changes.

/**
 * @template {object} T
 * @typedef {object} Store
 * @property {() => T} get Returns the current state.
 * @property {(change: Partial<T>) => void} set Changes members. Listeners are called once, in a microtask.
 * @property {(listener: () => void) => void} on Adds a listener.
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
