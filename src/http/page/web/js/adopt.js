// Properties that an element got before its class was loaded.

/**
 * A property that was set on an element before its class was defined hides the accessor of the class. It is set again.
 * @param {HTMLElement} element One with a property `shown`.
 */
export function adoptShown(element) {
  const early = Object.getOwnPropertyDescriptor(element, 'shown')?.value;
  if (early === undefined) return;
  Reflect.deleteProperty(element, 'shown');
  Reflect.set(element, 'shown', early);
}
