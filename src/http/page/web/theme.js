// Runs before the first paint: the reader's own choice of light or dark, else what the system says, also when that changes.
const dark = matchMedia('(prefers-color-scheme: dark)');

function applyTheme() {
  let theme = null;
  try {
    theme = localStorage.getItem('railhead.theme');
  } catch {
    // Storage is switched off; the system's choice holds.
  }
  const chosen = theme === 'light' || theme === 'dark';
  document.documentElement.dataset.theme = chosen ? theme : dark.matches ? 'dark' : 'light';
}

applyTheme();
dark.addEventListener('change', applyTheme);
// Paper is light.
addEventListener('beforeprint', () => {
  document.documentElement.dataset.theme = 'light';
});
addEventListener('afterprint', applyTheme);
