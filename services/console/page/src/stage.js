// One WebGL context for all views: each is a part of the canvas, and is redrawn only when it changed.
import { PerspectiveCamera, WebGLRenderer } from 'three';

/**
 * @typedef {object} View
 * @property {HTMLElement} element the element that the picture covers
 * @property {import('three').Scene} scene
 * @property {PerspectiveCamera} camera
 * @property {(aspect: number) => void} aim sets the camera up
 * @property {() => void} [drawn] called after a picture
 */

/** Minimum interval between pictures with software rendering, which may run on Leo's own computer. */
const SOFTWARE_EVERY_MS = 45;

/** Whether rendering is done in software. */
export function isSoftware() {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (gl === null) return true;
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = info === null ? '' : String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL));
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

export class Stage {
  /** @type {View[]} */
  views = [];
  /** @type {Set<View>} */
  #stale = new Set();
  #waiting = false;
  #drawn = 0;
  #canvas;
  /** The renderer; `null` if the browser cannot draw. @type {WebGLRenderer | null} */
  renderer = null;
  pictures = 0;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{software: boolean}} how
   * @param {(why: string) => void} blind called if the browser cannot draw; the rest of the page works
   */
  constructor(canvas, { software }, blind) {
    this.#canvas = canvas;
    this.software = software;
    try {
      const renderer = new WebGLRenderer({
        canvas,
        antialias: !software,
        preserveDrawingBuffer: true,
        powerPreference: 'low-power',
      });
      renderer.setPixelRatio(software ? 1 : Math.min(2, devicePixelRatio));
      renderer.shadowMap.enabled = !software;
      renderer.setScissorTest(true);
      this.renderer = renderer;
    } catch (error) {
      canvas.hidden = true;
      blind(error instanceof Error ? error.message : String(error));
    }
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener('webglcontextrestored', () => this.request());
  }

  /** @param {View} view */
  add(view) {
    this.views.push(view);
    new ResizeObserver(() => this.resize()).observe(view.element);
    this.request(view);
  }

  resize() {
    const { clientWidth, clientHeight } = this.#canvas;
    this.renderer?.setSize(clientWidth, clientHeight, false);
    this.#clear();
    // Resizing clears the canvas, so draw at once to avoid flicker.
    for (const view of this.views) this.#stale.add(view);
    this.#draw();
  }

  /** Makes the canvas transparent: a view that has moved leaves nothing behind. */
  #clear() {
    const { renderer } = this;
    if (renderer === null) return;
    renderer.setScissorTest(false);
    renderer.setClearColor(0, 0);
    renderer.clear();
    renderer.setScissorTest(true);
  }

  /** Requests a redraw in the next animation frame. @param {...View} views default: all */
  request(...views) {
    for (const view of views.length === 0 ? this.views : views) this.#stale.add(view);
    if (this.#waiting) return;
    this.#waiting = true;
    const draw = () => requestAnimationFrame(() => {
      this.#waiting = false;
      this.#draw();
    });
    const rest = this.software ? this.#drawn + SOFTWARE_EVERY_MS - performance.now() : 0;
    if (rest > 0) setTimeout(draw, rest);
    else draw();
  }

  #draw() {
    this.#drawn = performance.now();
    const stale = [...this.#stale];
    this.#stale.clear();
    const place = this.#canvas.getBoundingClientRect();
    for (const view of stale) {
      const rect = view.element.getBoundingClientRect();
      if (rect.width < 2 || rect.height < 2) continue;
      const [x, y] = [rect.left - place.left, place.bottom - rect.bottom];
      this.renderer?.setViewport(x, y, rect.width, rect.height);
      this.renderer?.setScissor(x, y, rect.width, rect.height);
      view.aim(rect.width / rect.height);
      this.renderer?.render(view.scene, view.camera);
      view.drawn?.();
    }
    this.pictures += 1;
  }
}

/** A camera for a world with z up. */
export function camera() {
  const made = new PerspectiveCamera(45, 1, 0.02, 20);
  made.up.set(0, 0, 1);
  return made;
}
