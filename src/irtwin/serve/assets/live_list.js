"use strict";
// The robots that are or were watched, of each the run that lasts, else the newest: asked of /sparql each second.
(function () {
  const QUERY = `SELECT ?robot ?name ?stream ?at ?energy ?power (COUNT(DISTINCT ?alarm) AS ?alarms) WHERE {
    { SELECT ?robot (MAX(?rank) AS ?first) { VALUES ?watched { irt:Live_Run irt:Replayed_Run } ?any a ?watched ; irt:run_of ?robot ; irt:Start_Time ?began ; irt:Stream_State ?goes
      BIND(CONCAT(IF(?goes = "ended", "0 ", "1 "), STR(?began)) AS ?rank) } GROUP BY ?robot }
    ?run irt:run_of ?robot ; irt:Start_Time ?start ; irt:Stream_State ?stream ; irt:State_Time ?at .
    FILTER(CONCAT(IF(?stream = "ended", "0 ", "1 "), STR(?start)) = ?first)
    ?robot irt:has_Information / irt:IR_Name ?name .
    OPTIONAL { ?run irt:Run_Power ?power OPTIONAL { ?run irt:Measured_Energy ?measured } OPTIONAL { ?run irt:Modelled_Energy ?modelled } }
    BIND(COALESCE(?measured, ?modelled) AS ?energy)
    OPTIONAL { ?alarm irt:alarm_of_Run ?run ; irt:Alarm_State "active" }
  } GROUP BY ?robot ?name ?stream ?at ?energy ?power ORDER BY ?name`;
  const rows = document.getElementById("robots"), none = document.getElementById("none"), trouble = document.getElementById("trouble");

  function cell(row, text, kind) {
    const made = row.insertCell();
    made.textContent = text;
    if (kind) made.className = kind;
    return made;
  }

  function show(found) {
    none.hidden = found.length > 0;
    rows.replaceChildren();
    for (const robot of found) {
      const value = (name) => (robot[name] ? robot[name].value : "");
      const row = rows.insertRow(), link = document.createElement("a"), number = (text, unit) => (text ? Number(text).toFixed(0) + " " + unit : "");
      link.href = "/live/" + encodeURIComponent(decodeURIComponent(value("robot").split("/").pop()));
      link.textContent = value("name");
      cell(row, "").append(link);
      cell(row, value("stream"), "stream " + value("stream"));
      cell(row, value("at") ? new Date(value("at")).toLocaleString() : "");
      cell(row, value("energy") ? (Number(value("energy")) / 3600).toFixed(2) + " Wh" : "", "number");
      cell(row, number(value("power"), "W"), "number");
      cell(row, value("alarms") === "0" ? "none" : value("alarms") + " active", value("alarms") === "0" ? "" : "alarm");
    }
  }

  async function ask() {
    try {
      const answer = await fetch("/sparql?query=" + encodeURIComponent(QUERY), { headers: { Accept: "application/sparql-results+json" } });
      if (!answer.ok) throw new Error(await answer.text());
      show((await answer.json()).results.bindings);
      trouble.hidden = true;
    } catch (error) {
      trouble.textContent = "The endpoint does not answer: " + error.message;
      trouble.hidden = false;
    }
    setTimeout(ask, 1000);
  }
  ask();
})();
