// Measures the frame rate of the page with a table full of blocks. It alternates with a bare page of the same size in
// the same browser, which draws an empty picture in every frame. Prints one JSON document:
//
//   node tests/pace.mjs [BLOCKS]           software rendering
//   node tests/pace.mjs [BLOCKS] --card    the graphics card, if the browser finds one
//
// It fails if the page reaches less than a quarter of the expected rate relative to the bare page. Other load on the
// machine slows both, but the page more, because it has more to do.
import { launch, opened, ready } from './browser.mjs';
import { crowded, serve } from './fake.mjs';

/** Expected pictures of the page, while a thing is carried, per sixty of the bare page. */
const PROMISED = { card: 30, software: 10 };
const ROUNDS = 3;
const SECONDS = 2;
const SIZE = { viewport: { width: 1280, height: 800 } };

const card = process.argv.includes('--card');
const blocks = Number(process.argv.slice(2).find((word) => word !== '--card') ?? 100);

/** Number of pictures, and the time that they took by the page's own clock. */
class Count {
  pictures = 0;
  seconds = 0;

  add([pictures, seconds]) {
    this.pictures += pictures;
    this.seconds += seconds;
  }

  get pace() {
    return this.pictures / this.seconds;
  }
}

/** A bare page: an empty picture in every frame, measured like the real page. */
const drawNothing = async (seconds) => {
  const canvas = document.body.appendChild(document.createElement('canvas'));
  [canvas.width, canvas.height] = [innerWidth, innerHeight];
  const gl = canvas.getContext('webgl2', { antialias: false, preserveDrawingBuffer: true });
  const began = performance.now();
  let pictures = 0;
  while (performance.now() - began < 1000 * seconds) {
    await new Promise((done) => requestAnimationFrame(done));
    gl.clearColor((pictures % 100) / 100, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    pictures += 1;
  }
  return [pictures, (performance.now() - began) / 1000];
};

/** Leo's page with something new in every frame: in the main view, as while a thing is carried, or in all views. */
const drawLeo = async ([seconds, all]) => {
  const { stage, pictures } = window.leo;
  const gl = stage.renderer.getContext();
  const [began, first] = [performance.now(), pictures()];
  while (performance.now() - began < 1000 * seconds) {
    stage.request(...(all ? stage.views : stage.views.slice(0, 1)));
    await new Promise((done) => requestAnimationFrame(done));
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }
  return [pictures() - first, (performance.now() - began) / 1000];
};

const { address, close } = await serve(0, crowded(blocks));
const browser = await launch({ card });
const [bare, main, all] = [new Count(), new Count(), new Count()];
let software = true;
for (let round = 0; round < ROUNDS; round += 1) {
  const empty = await opened(browser, SIZE);
  bare.add(await empty.evaluate(drawNothing, SECONDS));
  await empty.close();
  const page = await opened(browser, SIZE);
  await page.goto(address);
  await ready(page);
  software = await page.evaluate(() => window.leo.stage.software);
  main.add(await page.evaluate(drawLeo, [SECONDS, false]));
  all.add(await page.evaluate(drawLeo, [SECONDS, true]));
  await page.close();
}
await browser.close();
await close();

const promised = software ? PROMISED.software : PROMISED.card;
const ofSixty = (count) => (60 * count.pace) / bare.pace;
const rounded = (number) => Math.round(10 * number) / 10;
console.log(JSON.stringify({
  blocks,
  drawn: software ? 'by software' : 'by a graphics card',
  a_second: { bare: rounded(bare.pace), main_view: rounded(main.pace), all_views: rounded(all.pace) },
  of_sixty_bare_ones: { promised, main_view: rounded(ofSixty(main)), all_views: rounded(ofSixty(all)) },
}));
if (!(ofSixty(main) >= promised / 4)) {
  console.error(`of ${blocks} blocks the page draws ${rounded(ofSixty(main))} pictures while a bare page draws sixty, and should draw ${promised}`);
  process.exitCode = 1;
}
