// Bundle src/ into ../w2b_web/static, and write the hashes of what it was made from and of.

import { createHash } from 'node:crypto';
import { mkdir, readFile, readdir, rm, writeFile } from 'node:fs/promises';
import { build } from 'esbuild';

const out = process.argv[2] ?? '../w2b_web/static';
const sha256 = data => createHash('sha256').update(data).digest('hex');
const hashes = async (folder, names) => Object.fromEntries(await Promise.all(
  names.sort().map(async name => [name, sha256(await readFile(`${folder}/${name}`))])));

await rm(out, { recursive: true, force: true });
await mkdir(out, { recursive: true });
await build({
  entryPoints: { page: 'src/main.js' }, bundle: true, minify: true, format: 'esm',
  target: 'es2022', legalComments: 'none', outfile: `${out}/page.js` });
await build({
  entryPoints: ['src/microphone.js'], bundle: true, minify: true, format: 'esm',
  target: 'es2022', legalComments: 'none', outfile: `${out}/microphone.js` });
await build({
  entryPoints: ['src/page.css'], bundle: true, minify: true, target: 'es2022',
  legalComments: 'none', outfile: `${out}/page.css` });
const { packages } = JSON.parse(await readFile('package-lock.json', 'utf8'));
let licences = 'Libraries in page.js and page.css\n';
for (const name of ['three', 'uplot']) {
  const { version } = packages[`node_modules/${name}`];
  const text = await readFile(`node_modules/${name}/LICENSE`, 'utf8');
  licences += `\n${name} ${version}\n\n${text.trim()}\n`;
}
await writeFile(`${out}/licences.txt`, licences);
const manifest = {
  sources: { ...await hashes('src', await readdir('src')),
    ...await hashes('.', ['build.mjs', 'package.json', 'package-lock.json']) },
  bundle: await hashes(out, await readdir(out)) };
await writeFile(`${out}/manifest.json`, `${JSON.stringify(manifest, null, 1)}\n`);
