// Bundles the page into built/, gzipped. Builds are reproducible.
// With `--check` it compares the build with the existing files instead of writing.
import { build } from 'esbuild';
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gunzipSync, gzipSync } from 'node:zlib';

const here = dirname(fileURLToPath(import.meta.url));

/** @returns {Promise<Record<string, Uint8Array>>} the three files of the page, by name */
export async function bundle() {
  const script = await build({
    entryPoints: [join(here, 'src/main.js')],
    bundle: true,
    minify: true,
    format: 'esm',
    target: 'es2022',
    legalComments: 'none',
    write: false,
    // Leo's body consists of boxes, cylinders and spheres, so the mesh loaders are replaced by stubs.
    alias: {
      'three/examples/jsm/loaders/STLLoader.js': join(here, 'src/no-loader.js'),
      'three/examples/jsm/loaders/ColladaLoader.js': join(here, 'src/no-loader.js'),
    },
  });
  const style = await build({
    entryPoints: [join(here, 'style.css')],
    minify: true,
    write: false,
  });
  return {
    'index.html': await readFile(join(here, 'index.html')),
    'page.js': script.outputFiles[0].contents,
    'page.css': style.outputFiles[0].contents,
  };
}

/** Level 9, no time, and the byte for the operating system set: the same on every machine. */
function squeeze(bytes) {
  const packed = gzipSync(bytes, { level: 9 });
  packed.fill(0, 4, 8);
  packed[9] = 255;
  return packed;
}

async function main() {
  const check = process.argv.includes('--check');
  await mkdir(join(here, 'built'), { recursive: true });
  let stale = 0;
  for (const [name, bytes] of Object.entries(await bundle())) {
    const path = join(here, 'built', `${name}.gz`);
    const packed = squeeze(bytes);
    if (check) {
      // Compare uncompressed: gzip output may differ between Node versions.
      const there = await readFile(path).then(gunzipSync).catch(() => Buffer.alloc(0));
      if (!there.equals(bytes)) {
        console.error(`${path} is not what the sources build: run npm run build and commit it`);
        stale += 1;
      }
    } else {
      await writeFile(path, packed);
      console.log(`${name}: ${bytes.length} bytes, ${packed.length} gzipped`);
    }
  }
  process.exitCode = stale === 0 ? 0 : 1;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) await main();
