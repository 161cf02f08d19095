// The order of the panels.
import { find } from './element.js';

/**
 * In one column the dialogue follows the picture, so that the text field is near.
 * @param {MediaQueryList} narrow whether there is one column
 */
export function arrange(narrow) {
  const place = () => {
    const talk = find('talk');
    if (narrow.matches) find('minds').before(talk);
    else find('learned').before(talk);
  };
  narrow.addEventListener('change', place);
  place();
}
