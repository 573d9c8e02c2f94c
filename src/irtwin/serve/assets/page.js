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
      value: withPrefixes("SELECT ?name ?energy_kWh WHERE {\n  ?robot irt:has_Information / irt:IR_Name ?name .\n  ?total irt:total_of ?robot ; a irt:Robot_Total ; irt:Total_Energy ?energy_J .\n  BIND(?energy_J / 3.6e6 AS ?energy_kWh)\n} LIMIT 100\n"),
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
