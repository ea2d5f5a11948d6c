// Tests that vendored files are identical to those of the listed packages.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';

const VENDOR = new URL('../../../src/http/page/web/vendor/', import.meta.url);
const HERE = new URL('../', import.meta.url);
const list = JSON.parse(readFileSync(new URL('vendor.json', VENDOR), 'utf8'));
const lock = JSON.parse(readFileSync(new URL('package-lock.json', HERE), 'utf8'));

test('vendored files are those of the installed packages, whose archives were checked by their digests', () => {
  assert.ok(list.length > 0);
  for (const { package: name, version, tarball, files } of list) {
    const locked = lock.packages[`node_modules/${name}`];
    assert.deepEqual([locked.version, locked.integrity], [version, tarball], name);
    for (const { file, path } of files) {
      assert.ok(readFileSync(new URL(file, VENDOR)).equals(readFileSync(new URL(`node_modules/${name}/${path}`, HERE))), file);
    }
  }
});
