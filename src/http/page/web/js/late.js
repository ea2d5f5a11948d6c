// Elements that are loaded when they are needed.

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
