"use strict";
(async () => {
  const endpoint = new URL("/sparql", location.href).href;
  document.getElementById("address").textContent = endpoint;
  const { prefixes, questions } = await (await fetch("/questions.json")).json();

  const withPrefixes = (text) => {
    const used = Object.entries(prefixes).filter(
      ([name]) => new RegExp(`(^|[^\\w:-])${name}:`).test(text) && !new RegExp(`prefix\\s+${name}:`, "i").test(text));
    return used.map(([name, space]) => `PREFIX ${name}: <${space}>\n`).join("") + text;
  };

  const editor = new Yasgui(document.getElementById("yasgui"), {
    requestConfig: { endpoint, method: "POST", acceptHeaderGraph: "text/turtle,application/n-triples;q=0.9" },
    copyEndpointOnNewTab: false,
    persistenceId: "irtwin",
    endpointCatalogueOptions: { getData: () => [] },
    yasqe: {
      autocompleters: ["variables"],
      value: withPrefixes("SELECT ?robot ?name WHERE {\n  ?robot a irt:Industrial_Robot ; rdfs:label ?name .\n} LIMIT 100\n"),
    },
    yasr: { prefixes },
  });

  const list = document.getElementById("questions");
  for (const { title, question, text } of questions) {
    const button = document.createElement("button");
    const note = document.createElement("small");
    button.type = "button";
    button.textContent = title;
    note.textContent = question;
    button.append(note);
    button.addEventListener("click", () => {
      const tab = editor.addTab(true, { name: title }, { avoidDuplicateTabs: false });
      tab.setQuery(withPrefixes(text));
      tab.query();
    });
    const item = document.createElement("li");
    item.append(button);
    list.append(item);
  }
  document.getElementById("filter").addEventListener("input", ({ target }) => {
    const wanted = target.value.trim().toLowerCase();
    for (const item of list.children) item.hidden = !item.textContent.toLowerCase().includes(wanted);
  });
})();
