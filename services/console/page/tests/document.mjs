// A minimal DOM for tests of the panels without a browser. It counts removed elements.

class Node {
  parent = null;

  remove() {
    if (this.parent === null) return;
    this.parent.nodes.splice(this.parent.nodes.indexOf(this), 1);
    this.parent = null;
    if (this instanceof Element) taken.push(this);
  }

  get nextSibling() {
    return this.parent?.nodes[this.parent.nodes.indexOf(this) + 1] ?? null;
  }

  get previousElementSibling() {
    return this.parent?.nodes[this.parent.nodes.indexOf(this) - 1] ?? null;
  }

  after(node) {
    this.parent.insertBefore(node, this.nextSibling);
  }
}

class Words extends Node {
  constructor(text) {
    super();
    this.textContent = text;
  }
}

/** Elements that were removed from their parents, in order. @type {Element[]} */
export const taken = [];

export class Element extends Node {
  nodes = [];
  dataset = {};
  hidden = false;
  disabled = false;
  attributes = {};
  listeners = {};
  style = {};
  value = '';
  scrollHeight = 0;
  scrollTop = 0;
  clientHeight = 0;

  constructor(tag) {
    super();
    this.tag = tag;
  }

  get children() {
    return this.nodes.filter((node) => node instanceof Element);
  }

  get firstElementChild() {
    return this.children[0] ?? null;
  }

  get lastElementChild() {
    return this.children.at(-1) ?? null;
  }

  get textContent() {
    return this.nodes.map((node) => node.textContent).join('');
  }

  set textContent(text) {
    this.replaceChildren(text);
  }

  /** The value of a select, which is one of its options. */
  get selectedOptions() {
    return this.children.filter((option) => option.attributes.value === this.value).slice(0, 1);
  }

  setAttribute(name, value) {
    this.attributes[name] = value;
  }

  getAttribute(name) {
    return this.attributes[name] ?? null;
  }

  addEventListener(kind, listener) {
    this.listeners[kind] = listener;
  }

  insertBefore(node, before) {
    const child = typeof node === 'string' ? new Words(node) : node;
    child.remove();
    this.nodes.splice(before === null ? this.nodes.length : this.nodes.indexOf(before), 0, child);
    child.parent = this;
  }

  append(...nodes) {
    for (const node of nodes) this.insertBefore(node, null);
  }

  prepend(node) {
    this.insertBefore(node, this.nodes[0] ?? null);
  }

  replaceChildren(...nodes) {
    for (const node of [...this.nodes]) node.remove();
    if (this.tag === 'select') this.value = nodes[0]?.attributes.value ?? '';
    this.append(...nodes);
  }

  querySelector(selector) {
    return this.children.find((child) => `.${child.attributes.class}` === selector) ?? null;
  }
}

/**
 * A document with elements of these ids and tags, for the modules that look them up.
 * @param {Record<string, string>} tags
 * @returns {Record<string, Element>}
 */
export function furnish(tags) {
  const ids = Object.fromEntries(Object.entries(tags).map(([id, tag]) => [id, new Element(tag)]));
  globalThis.document = {
    createElement: (tag) => new Element(tag),
    createElementNS: (_space, tag) => new Element(tag),
    getElementById: (id) => ids[id] ?? null,
    body: new Element('body'),
    activeElement: null,
  };
  taken.length = 0;
  return ids;
}
