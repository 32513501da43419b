// The changed parameters in the fragment of the address: #stop.restitution=0.4&flexure.length=0.05

// Return the changes of a fragment as a Map of names to numbers, and messages about wrong items.
// Numbers that are none are kept as NaN: the kernel rejects them with a message.
function changesOf(fragment, known) {
  const changes = new Map();
  const problems = [];
  for (const item of fragment.replace(/^#/, "").split("&").filter(Boolean)) {
    const [name, text] = decoded(item);
    if (!known.has(name)) {
      problems.push(`The link has an unknown parameter, which was ignored: ${name.slice(0, 60)}.`);
    } else {
      changes.set(name, parsed(text));
    }
  }
  return { changes, problems };
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

function fragmentOf(changes) {
  return [...changes].map(([name, x]) => `${encodeURIComponent(name)}=${x}`).join("&");
}

// Show the changes in the address, without a new entry in the history.
function showFragment(changes) {
  const fragment = fragmentOf(changes);
  const address = fragment ? `#${fragment}` : location.href.split("#")[0];
  try {
    history.replaceState(null, "", address);
  } catch {
    // Some browsers forbid it for files; the button copies the link nevertheless.
  }
}

// Return the link to this page with the changes.
function linkWith(changes) {
  const fragment = fragmentOf(changes);
  return location.href.split("#")[0] + (fragment ? `#${fragment}` : "");
}
