// What stands behind the # of an address: every setting that is not the page's own, and the time that is shown.
/** The key of the time: names are escaped, and no escaped name begins with @. */
const TIME_KEY = '@t';

/** The link of settings [name, value]; without a time where that is null. */
function writeLink(settings, time) {
  const parts = settings.map(([name, value]) => `${encodeURIComponent(name)}=${+value.toPrecision(12)}`);
  if (time !== null) parts.push(`${TIME_KEY}=${+time.toPrecision(6)}`);
  return '#' + parts.join('&');
}

/** What a link says to a page with these names: values by name, the time or null, and what is wrong with it, in words. */
function readLink(hash, names) {
  const found = {values: new Map(), time: null, wrong: []};
  for (const part of hash.replace(/^#/, '').split('&').filter(Boolean)) {
    let name, text;
    try {
      [, name, text] = part.match(/^([^=]*)=?(.*)$/s).map(decodeURIComponent);
    } catch {
      found.wrong.push(`The link holds ‘${part}’, which is not escaped as in addresses.`);
      continue;
    }
    const isName = names.has(name), value = text.trim() ? Number(text) : NaN;
    if (!isName && name !== TIME_KEY) found.wrong.push(`The link sets ‘${name}’, which this page does not have.`);
    else if (!Number.isFinite(value)) found.wrong.push(`The link sets ‘${name}’ to ‘${text}’, which is not a number.`);
    else if (isName) found.values.set(name, value);
    else found.time = value;
  }
  return found;
}
