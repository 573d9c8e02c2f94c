"use strict";
// The query page: an editor, questions that can be asked by a click, and what the endpoint answers.
(async () => {
  const endpoint = new URL("/sparql", location.href).href;
  const find = (id) => document.getElementById(id);
  const MOST = 64e6; // characters of an answer that a page holds
  const ACCEPT = "application/sparql-results+json, text/turtle;q=0.9";
  const FIRST = "SELECT ?robot ?energy_kWh WHERE {\n  ?total irt:total_of ?arm ; a irt:Robot_Total ; irt:Total_Energy ?energy_J .\n" +
    "  ?arm irt:has_Information / irt:IR_Name ?robot .\n  BIND(?energy_J / 3.6e6 AS ?energy_kWh)\n} ORDER BY DESC(?energy_kWh) LIMIT 100\n";
  find("address").textContent = endpoint;
  const { prefixes, questions, headings } = await (await fetch("/questions.json")).json();

  const withPrefixes = (text) => {
    const used = Object.entries(prefixes).filter(
      ([name]) => new RegExp(`(^|[^\\w:-])${name}:`).test(text) && !new RegExp(`prefix\\s+${name}:`, "i").test(text));
    return used.map(([name, space]) => `PREFIX ${name}: <${space}>\n`).join("") + text;
  };

  const editor = new Yasqe(find("editor"), {
    value: withPrefixes(FIRST),
    persistenceId: "irtwin-query",
    autocompleters: ["variables"],
    showQueryButton: false,
    createShareableLink: null,
    pluginButtons: () => [],
    lineWrapping: true,
    resizeable: false,
  });
  // Ask on Ctrl+Enter; Tab leaves the editor, or who has no mouse could not.
  const keys = { "Ctrl-Enter": () => ask(), "Cmd-Enter": () => ask(), Tab: false, "Shift-Tab": false };
  editor.setOption("extraKeys", { ...editor.getOption("extraKeys"), ...keys });
  editor.getInputField().setAttribute("aria-label", "SPARQL query; Tab leaves the editor");

  const shown = irtwinAnswer(find("answer"), { prefixes, headings });
  const say = (text, bad) => { find("said").textContent = text; find("said").className = bad ? "banner" : ""; };
  const STANDS = { behind: "is behind the database", updating: "is being updated just now" };
  let asking = null;

  async function ask() {
    if (asking) asking.abort();
    const mine = (asking = new AbortController()), began = performance.now();
    const text = editor.getValue();
    say("Asking…");
    find("stop").hidden = false;
    try {
      const answer = await post(text, ACCEPT, mine.signal);
      const body = await answer.text();
      if (!answer.ok) throw new Error(body.trim());
      if (body.length > MOST) throw new Error("There is more of this than a page holds: add a LIMIT, or ask the endpoint for CSV.");
      const json = answer.headers.get("Content-Type").includes("json");
      const what = json ? shown.results(JSON.parse(body), () => csv(text)) : shown.triples(body);
      const stands = STANDS[answer.headers.get("Irtwin-Graph")];
      say(`${what}, in ${((performance.now() - began) / 1000).toFixed(2)} s.${stands ? ` The graph ${stands}: the answer may lack something.` : ""}`, stands);
    } catch (error) {
      if (mine !== asking) return; // another was asked meanwhile
      shown.clear();
      say(error.name === "AbortError" ? "Stopped." : error.message, error.name !== "AbortError");
    } finally {
      if (mine === asking) { asking = null; find("stop").hidden = true; }
    }
  }

  function post(text, accept, signal) {
    const headers = { "Content-Type": "application/sparql-query", Accept: accept };
    return fetch(endpoint, { method: "POST", headers, body: text, signal });
  }

  async function csv(text) {
    const answer = await post(text, "text/csv");
    if (!answer.ok) { say((await answer.text()).trim(), true); return; }
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await answer.blob());
    link.download = "answer.csv";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  find("run").addEventListener("click", () => ask());
  find("stop").addEventListener("click", () => { if (asking) asking.abort(); });

  const list = find("questions");
  for (const { title, question, text } of questions) {
    const button = document.createElement("button"), note = document.createElement("small"), item = document.createElement("li");
    button.type = "button";
    button.textContent = title;
    note.textContent = question;
    button.append(note);
    const short = text.replace(/^# (title|theme|of): .*\n/gm, "").replace(/^# question: /m, "# ");
    button.addEventListener("click", () => { editor.setValue(withPrefixes(short)); ask(); });
    item.append(button);
    list.append(item);
  }
  find("filter").addEventListener("input", ({ target }) => {
    const wanted = target.value.trim().toLowerCase();
    for (const item of list.children) item.hidden = !item.textContent.toLowerCase().includes(wanted);
  });
})();
