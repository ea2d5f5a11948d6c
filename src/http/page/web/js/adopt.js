// What an element was given before its class was loaded.

/**
 * What was given to an element before its class was there lies in front of the property of the class; it is given again.
 * @param {HTMLElement} element One with a property `shown`.
 */
export function adoptShown(element) {
  const early = Object.getOwnPropertyDescriptor(element, 'shown')?.value;
  if (early === undefined) return;
  Reflect.deleteProperty(element, 'shown');
  Reflect.set(element, 'shown', early);
}
