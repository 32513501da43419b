// The changed parameters in the fragment of the address: #stop.restitution=0.4&flexure.length=0.05
// The duration is stop-time, which is no name of a parameter because of its hyphen.

const STOP_TIME = "stop-time";

// Return the changes of a fragment as a Map of names to numbers, the duration or null, and messages
// about wrong items.
// Numbers that are none are kept as NaN: the kernel rejects them with a message.
function changesOf(fragment, known) {
  const changes = new Map();
  const problems = [];
  let stopTime = null;
  for (const item of fragment.replace(/^#/, "").split("&").filter(Boolean)) {
    const [name, text] = decoded(item);
    if (name === STOP_TIME) {
      stopTime = parsed(text);
    } else if (!known.has(name)) {
      problems.push(`The link has an unknown parameter, which was ignored: ${name.slice(0, 60)}.`);
    } else {
      changes.set(name, parsed(text));
    }
  }
  return { changes, stopTime, problems };
}

function decoded(item) {
  const split = item.indexOf("=");
  const parts = split < 0 ? [item, ""] : [item.slice(0, split), item.slice(split + 1)];
  try {
    return parts.map(decodeURIComponent);
  } catch {
    return parts;
  }
}

function fragmentOf(changes, stopTime) {
  const given = stopTime === null ? changes : [...changes, [STOP_TIME, stopTime]];
  return [...given].map(([name, x]) => `${encodeURIComponent(name)}=${x}`).join("&");
}

// Show the changes, and a duration that is not null, in the address, without a new entry in the history.
function showFragment(changes, stopTime) {
  const fragment = fragmentOf(changes, stopTime);
  const address = fragment ? `#${fragment}` : location.href.split("#")[0];
  try {
    history.replaceState(null, "", address);
  } catch {
    // Some browsers forbid it for files; the button copies the link nevertheless.
  }
}

// Return the link to this page with the changes, and a duration that is not null.
function linkWith(changes, stopTime) {
  const fragment = fragmentOf(changes, stopTime);
  return location.href.split("#")[0] + (fragment ? `#${fragment}` : "");
}
