"use strict";
// Runs the page's packed scripts, in their order. A page may hold this more than once: the later ones wait for the earlier.
(function () {
  const packed = [...document.querySelectorAll('script[type="application/gzip"]')];
  packed.forEach((element) => element.remove());

  async function textOf(element) {
    const bytes = Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  async function run() {
    for (const element of packed) {
      const script = document.createElement("script");
      script.textContent = await textOf(element);
      document.body.appendChild(script);
    }
  }

  function complain() {
    const note = document.createElement("p");
    note.className = "absent";
    note.textContent = "This browser is too old to draw the figures of this page (it has no DecompressionStream). Text and tables are whole.";
    document.body.prepend(note);
  }

  const before = window.irtwinUnpacked || Promise.resolve();
  if ("DecompressionStream" in window) window.irtwinUnpacked = before.then(run);
  else if (!window.irtwinUnpacked) { window.irtwinUnpacked = before; complain(); }
})();
