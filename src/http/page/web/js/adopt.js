// Restores properties that were set on an element before its class was loaded.

/**
 * A property that was set on an element before its class was defined hides the accessor of the class. This function sets it again.
 * @param {HTMLElement} element An element whose class has an accessor `shown`.
 */
export function adoptShown(element) {
  const early = Object.getOwnPropertyDescriptor(element, 'shown')?.value;
  if (early === undefined) return;
  Reflect.deleteProperty(element, 'shown');
  Reflect.set(element, 'shown', early);
}
