"use strict";
// What a query answers: a table under readable headings, a yes or no, or triples; and a plot of a table.
(function () {
  const MOST_ROWS = 500; // that are shown at once; the CSV has all
  const OURS = "https://w3id.org/irtwin", XSD = "http://www.w3.org/2001/XMLSchema#";
  const NUMBERS = new Set(["integer", "decimal", "double", "float", "int", "long", "nonNegativeInteger"].map((name) => XSD + name));

  // As report/wording.py does it, by the same tables.
  function headingOf(name, { units, words }) {
    const parts = name.replace(/([a-z])([A-Z][a-z])/g, "$1_$2").split("_").filter((part) => part);
    let unit = "";
    for (let count = Math.min(3, parts.length - 1); count > 0 && !unit; count--) {
      const end = parts.slice(-count).join("_");
      if (Object.hasOwn(units, end)) { unit = units[end]; parts.splice(-count); }
    }
    const text = parts.map((part) => (Object.hasOwn(words, part.toLowerCase()) ? words[part.toLowerCase()] : part)).join(" ") || name;
    return text.charAt(0).toUpperCase() + text.slice(1) + (unit ? ", " + unit : "");
  }

  const isNumber = (value) => value && value.type === "literal" && NUMBERS.has(value.datatype) && Number.isFinite(Number(value.value));

  function written(number) {
    if (Number.isInteger(number) && Math.abs(number) < 1e15) return number.toLocaleString("en").replaceAll(",", "\u202f").replace("-", "−");
    const size = Math.abs(number);
    if (size < 1e-4 || size >= 1e7) {
      const [mantissa, exponent] = number.toExponential(4).split("e");
      const raised = [...String(Number(exponent))].map((sign) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(sign)]).join("");
      return `${mantissa} × 10${raised}`.replace("-", "−");
    }
    return Number(number.toPrecision(5)).toLocaleString("en", { maximumFractionDigits: 8 }).replaceAll(",", "\u202f").replace("-", "−");
  }

  window.irtwinAnswer = function (place, { prefixes, headings }) {
    const short = (iri) => {
      const [name, space] = Object.entries(prefixes).filter(([, space]) => iri.startsWith(space)).sort((a, b) => b[1].length - a[1].length)[0] || [];
      return name === undefined ? iri : name + ":" + iri.slice(space.length);
    };

    function cell(row, value) {
      const made = row.insertCell();
      if (!value) return;
      if (value.type === "uri") {
        const link = document.createElement("a");
        const ours = value.value === OURS || value.value.startsWith(OURS + "/") || value.value.startsWith(OURS + "#");
        link.textContent = short(value.value);
        link.title = value.value;
        if (ours) link.href = value.value.slice(OURS.length - "/irtwin".length);
        else if (/^https?:/.test(value.value)) { link.href = value.value; link.rel = "noreferrer"; }
        made.append(link);
      } else if (isNumber(value)) {
        made.className = "number";
        made.textContent = written(Number(value.value));
        made.title = value.value;
      } else {
        made.textContent = value.type === "bnode" ? "_:" + value.value
          : value.datatype === XSD + "dateTime" ? value.value.replace("T", " ").replace(/(\.\d+)?(Z|\+00:00)$/, "") : value.value;
        if (value.datatype === XSD + "boolean") made.textContent = value.value === "true" ? "yes" : "no";
      }
    }

    function table({ names, rows, numeric }) {
      const scrolled = document.createElement("div"), made = document.createElement("table");
      Object.assign(scrolled, { className: "table tall", tabIndex: 0 });
      scrolled.setAttribute("role", "region");
      scrolled.setAttribute("aria-label", "Table: the answer");
      const head = made.createTHead().insertRow(), body = made.createTBody();
      for (const name of names) {
        const heading = document.createElement("th");
        heading.scope = "col";
        heading.textContent = headingOf(name, headings);
        heading.title = "?" + name;
        if (numeric.has(name)) heading.className = "number";
        head.append(heading);
      }
      for (const row of rows.slice(0, MOST_ROWS)) {
        const line = body.insertRow();
        for (const name of names) cell(line, row[name]);
      }
      scrolled.append(made);
      return scrolled;
    }

    function files(csv) {
      const button = document.createElement("button"), line = document.createElement("p");
      Object.assign(button, { type: "button", textContent: "Whole table as CSV" });
      button.addEventListener("click", csv);
      line.append(button);
      return line;
    }

    return {
      clear: () => place.replaceChildren(),
      results(json, csv) {
        if ("boolean" in json) {
          place.replaceChildren();
          return json.boolean ? "Yes" : "No";
        }
        const names = json.head.vars, rows = json.results.bindings;
        const numeric = new Set(names.filter((name) => rows.some((row) => row[name]) && rows.every((row) => !row[name] || isNumber(row[name]))));
        place.replaceChildren();
        if (rows.length) {
          const plot = irtwinPlot({ names, rows, numeric, heading: (name) => headingOf(name, headings), short });
          place.append(...(plot ? [plot] : []), table({ names, rows, numeric }), files(csv));
        }
        const count = rows.length === 1 ? "1 row" : rows.length ? `${rows.length} rows` : "No row fits";
        return rows.length > MOST_ROWS ? `${count}, of which the first ${MOST_ROWS} are shown` : count;
      },
      triples(text) {
        const made = document.createElement("pre");
        made.tabIndex = 0;
        made.setAttribute("aria-label", "Triples of the answer");
        made.textContent = text;
        place.replaceChildren(made);
        return "Triples";
      },
    };
  };
  window.irtwinAnswer.headingOf = headingOf;
})();
