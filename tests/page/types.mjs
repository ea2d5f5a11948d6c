// Checks the types of the page. Types of the API come from the contract, and types of vendored files from their packages.
import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const here = import.meta.dirname;
const staged = join(here, 'types');
rmSync(staged, { recursive: true, force: true });
mkdirSync(join(staged, 'vendor'), { recursive: true });
// The vendored files are left out, because the compiler would read them instead of their declarations.
cpSync(join(here, '../../src/http/page/web/js'), join(staged, 'js'), { recursive: true });
writeFileSync(join(staged, 'vendor/lit-html.d.ts'), "export * from 'lit-html';\n");
writeFileSync(join(staged, 'vendor/uPlot.esm.d.ts'), "import uPlot from 'uplot';\nexport default uPlot;\n");

/** @type {(tool: string, ...args: string[]) => void} */
const run = (tool, ...args) => {
  execFileSync(process.execPath, [join(here, 'node_modules', tool), ...args], { cwd: here, stdio: 'inherit' });
};
try {
  run('openapi-typescript/bin/cli.js', '../../api/openapi.json', '--output', 'types/contract.d.ts');
  run('typescript/bin/tsc', '--project', '.');
} catch {
  // The tools have reported the errors.
  process.exitCode = 1;
}
