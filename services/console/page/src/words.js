// Sentences for the page's user, who is the first teacher.

/**
 * Addresses a sentence about the teacher to them: "the teacher does not know …" becomes "you do not know …".
 * @param {string} text
 * @param {string} name the teacher's name
 */
export function toYou(text, name) {
  const verbs = [
    [`${name} does not `, 'you do not '],
    [`${name} is `, 'you are '],
    [`${name} believes `, 'you believe '],
    [`${name} no longer believes `, 'you no longer believe '],
    [`${name} has `, 'you have '],
    [`${name} and Leo `, 'you and Leo '],
    [`${name} thinks `, 'you think '],
    [`${name}'s `, 'your '],
  ];
  for (const [theirs, yours] of verbs) {
    if (text.startsWith(theirs)) return capital(yours + text.slice(theirs.length));
  }
  return capital(text);
}

/** @param {string} text */
export function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/**
 * The name of an agent: "you" for the first teacher.
 * @param {number} agent
 * @param {Record<string, string>} names
 */
export function whom(agent, names) {
  return agent === 1 ? 'you' : names[agent] ?? `partner ${agent}`;
}

/**
 * The heading over the beliefs of a perspective: "Leo believes", "Leo thinks you believe", and nested ones.
 * @param {{number: number, agents: number[]}} perspective
 * @param {Record<string, string>} names
 */
export function believes(perspective, names) {
  const path = perspective.agents.filter((agent, at) => !(at === 0 && agent === 0));
  let text = `${names[0] ?? 'Leo'} believes`;
  for (const agent of path) {
    text = text.replace(/believes?$/, (verb) => (verb === 'believe' ? 'think' : 'thinks'));
    text += agent === 1 ? ' you believe' : ` ${whom(agent, names)} believes`;
  }
  return text;
}

/**
 * The text for a perspective that does not differ from Leo's own. Empty if the two are not compared: it is nested,
 * or its agent has never been here.
 * @param {{number: number, agents: number[]} | undefined} perspective
 * @param {{present: boolean, beliefs: number} | undefined} mind
 * @param {Record<string, string>} names
 */
export function agrees(perspective, mind, names) {
  if (perspective === undefined || mind === undefined || (!mind.present && mind.beliefs === 0)) return '';
  const [agent, ...nested] = perspective.agents;
  if (nested.length > 0) return `None: it is what ${believes({ ...perspective, agents: perspective.agents.slice(0, -1) }, names)}.`;
  return `None: ${whom(agent, names)} ${agent === 1 ? 'know' : 'knows'} what ${names[0] ?? 'Leo'} knows.`;
}

/**
 * The perspective of an example or hypothesis: "as Leo saw it", "as you could see it".
 * @param {number[]} path the agents, from the outermost inwards
 * @param {Record<string, string>} names
 */
export function asSeenBy(path, names) {
  const last = path.at(-1);
  if (last === undefined) return `as ${names[0] ?? 'Leo'} saw it`;
  return `as ${whom(last, names)} could see it`;
}

/** Words for probabilities from a bound on, the highest first. */
const LIKELIHOODS = /** @type {const} */ ([[0.95, 'almost certain'], [0.6, 'likely'], [0.25, 'possible'], [0.02, 'unlikely'], [0, 'very unlikely']]);

/** A probability in words. @param {number} posterior */
export function likelihood(posterior) {
  return LIKELIHOODS.find(([bound]) => posterior >= bound)?.[1] ?? 'very unlikely';
}

/**
 * The view that an event of the learner names, for the page's user: "as you could see it". Pure.
 * @param {string} view "Leo's own view" or "the teacher's view"
 * @param {Record<string, string>} names
 */
function viewWords(view, names) {
  const agent = Object.keys(names).map(Number).find((each) => each > 0 && view === `${names[each]}'s view`);
  if (agent !== undefined) return asSeenBy([agent], names);
  return view === `${names[0] ?? 'Leo'}'s own view` ? asSeenBy([], names) : `in ${view}`;
}

/**
 * A rule of the log in words: "ALL BUT BLUE (the teacher's view)" becomes "all but blue, as you could see it". Pure.
 * @param {string} text
 * @param {Record<string, string>} names
 */
export function ruleWords(text, names) {
  const [, rule, view] = /^(.*) \(([^()]*)\)$/s.exec(text) ?? [];
  return rule === undefined ? text : `${plain(rule.toLowerCase())}, ${viewWords(view, names)}`;
}

/**
 * A hypothesis of the log: words, and the figures behind them. Pure.
 * @param {string} text "all but blue   in Leo's own view: posterior 0.9707, tally 2/2"
 * @param {Record<string, string>} names
 * @returns {{words: string, posterior: number, figures: string} | null} `null` for a text of another form
 */
export function thoughtWords(text, names) {
  const [, name, view, posterior, tally, examples] = /^(.*?)\s+in ([^:]*): posterior ([\d.]+), tally (\d+)\/(\d+)$/s.exec(text) ?? [];
  if (name === undefined) return null;
  const figures = `probability ${posterior}, explains ${tally} of ${examples} ${examples === '1' ? 'demonstration' : 'demonstrations'}`;
  return { words: `${plain(name)}, ${viewWords(view, names)}`, posterior: Number(posterior), figures };
}

/** Words that describe a thing, by the shipped percepts. */
const ADJECTIVES = 'small|medium-sized|large|red|green|blue|yellow|wood|white|black';

/**
 * Names of things as people say them: "medium green long" becomes "medium-sized green long thing". Pure.
 * @param {string} text
 */
export function plain(text) {
  return text.replace(/\bmedium (?=[a-z])/g, 'medium-sized ')
    .replace(new RegExp(`\\b(${ADJECTIVES}) long\\b(?! thing)`, 'g'), '$1 long thing');
}

/**
 * A duration in words: "0.4 s", "12 s", "3 min".
 * @param {number} seconds
 */
export function duration(seconds) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${seconds.toFixed(0)} s`;
  return `${(seconds / 60).toFixed(0)} min`;
}

/**
 * A thing's label: its name and its states.
 * @param {any} thing a cell `thing/<n>`
 * @param {Record<string, string>} names of agents
 */
export function describe(thing, names) {
  const parts = [thing.name];
  if (thing.kind === 'occluder') parts.push('screen');
  if (thing.filled === true) parts.push('hole filled');
  if (thing.filled === false && thing.hole) parts.push('hole empty');
  if (thing.marked === true) parts.push('marked');
  if (thing.inserted === true) parts.push('in a hole');
  if (thing.held !== null && thing.held !== undefined) {
    parts.push(thing.held === 1 ? 'in your hand' : `held by ${whom(thing.held, names)}`);
  }
  return parts.join(', ');
}
