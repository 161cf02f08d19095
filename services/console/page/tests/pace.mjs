// How many pictures a second the page draws by software: node tests/pace.mjs [BLOCKS]
import { launch, opened, ready } from './browser.mjs';
import { crowded, serve } from './fake.mjs';

const blocks = Number(process.argv[2] ?? 100);
const SECONDS = 5;
const { address, fake, close } = await serve(0, crowded(blocks));
const browser = await launch();
const page = await opened(browser, { viewport: { width: 1280, height: 800 } });
await page.goto(address);
await ready(page);

/** Pictures a second while `stir` keeps the page busy, called before every frame. */
const pace = (stir) => page.evaluate(async ([seconds, name]) => {
  const { stage, seat, pictures } = window.leo;
  const stirs = {
    all: () => stage.request(),
    main: () => stage.request(stage.views[0]),
  };
  const [began, first] = [performance.now(), pictures()];
  while (performance.now() - began < 1000 * seconds) {
    stirs[name]();
    await new Promise((done) => requestAnimationFrame(done));
    stage.renderer.getContext().readPixels(0, 0, 1, 1, 6408, 5121, new Uint8Array(4));
  }
  return (pictures() - first) / ((performance.now() - began) / 1000);
}, [SECONDS, stir]);
console.log(JSON.stringify({
  blocks, software: await page.evaluate(() => window.leo.stage.software),
  all_views_per_s: await pace('all'), main_view_per_s: await pace('main'), calls: await page.evaluate(() => window.leo.stage.renderer.info.render.calls),
  messages: fake.version,
}));
await browser.close();
await close();
