// Sets the light or dark theme before the first paint: the stored choice of the reader, or the setting of the system, whose changes are followed.
const dark = matchMedia('(prefers-color-scheme: dark)');

function applyTheme() {
  let theme = null;
  try {
    theme = localStorage.getItem('railhead.theme');
  } catch {
    // Storage is disabled; the setting of the system applies.
  }
  const chosen = theme === 'light' || theme === 'dark';
  document.documentElement.dataset.theme = chosen ? theme : dark.matches ? 'dark' : 'light';
}

applyTheme();
dark.addEventListener('change', applyTheme);
// Pages are printed in the light theme.
addEventListener('beforeprint', () => {
  document.documentElement.dataset.theme = 'light';
});
addEventListener('afterprint', applyTheme);
