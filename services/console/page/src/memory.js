// What this browser remembers of a visitor. Without storage, which a browser may forbid, everything lasts until a reload.

/** @param {string} key @returns {string | null} */
export function remembered(key) {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

/** @param {string} key @param {string} value */
export function remember(key, value) {
  try {
    localStorage.setItem(key, value);
  } catch {
    // Forbidden: shown again at the next visit.
  }
}
