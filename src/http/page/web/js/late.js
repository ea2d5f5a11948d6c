// Elements that are loaded when they are needed, and what they were given before.

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

let loading = false;

/** Loads the elements that draw curves and strips: they are a third of the page, and composing a case does not need them. */
export function loadCurves() {
  if (loading) return;
  loading = true;
  for (const element of [import('./curve.js'), import('./strips.js')]) {
    element.catch(() => {
      loading = false;
    });
  }
}
