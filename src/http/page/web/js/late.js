// Lazy loading of custom elements.

let loading = false;

/** Loads the elements that draw curves and strips. They are a third of the page, and the first view does not need them. */
export function loadCurves() {
  if (loading) return;
  loading = true;
  for (const element of [import('./curve.js'), import('./strips.js')]) {
    element.catch(() => {
      loading = false;
    });
  }
}
