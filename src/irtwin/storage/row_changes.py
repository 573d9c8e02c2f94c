"""Triggers note which rows change, whoever writes them, so that the graph can follow without reading all rows.

A note names a table and the primary key of a row that was written there; without key it means the whole table. The
newest notes are kept. A reader remembers the last note that it saw: while that one stands, no later one has gone.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from sqlalchemy import Connection, Engine

from irtwin.storage.engine import writing

TABLE = "row_change"
KEYS = ("key_1", "key_2", "key_3", "key_4")
_KEPT = 50_000  # notes
_MOST_OF_STATEMENT = 5_000  # rows that PostgreSQL notes one by one
_FUNCTION = "irtwin_note_rows"


@dataclass(frozen=True)
class KeyColumn:
    """A column of a primary key: of whole numbers, or of text."""

    name: str
    is_number: bool


Key = tuple[KeyColumn, ...]  # empty where rows are not told one by one


class _Sqlite:
    """A trigger a row. A changed trigger or table shows in the schema's version, so nobody needs to ask for more."""

    make = (
        f"""CREATE TABLE {TABLE} (number INTEGER PRIMARY KEY, token INTEGER NOT NULL, table_name TEXT NOT NULL,
            key_1 BLOB, key_2 BLOB, key_3 BLOB, key_4 BLOB)""",  # a BLOB column leaves values as they are
        f"""CREATE TRIGGER irtwin_fewer_notes AFTER INSERT ON {TABLE} WHEN NEW.number % 1000 = 0
            BEGIN DELETE FROM {TABLE} WHERE number <= NEW.number - {_KEPT}; END""",
        f"INSERT INTO {TABLE} (token, table_name) VALUES (random(), '')",
    )
    prepare = fewer = ""
    history = "SELECT ''"
    own = "SELECT name FROM main.sqlite_master WHERE type = 'table'"
    tables = """
        SELECT tables.name, columns.name AS part, upper(columns.type) IN ('INTEGER', 'BIGINT') AS is_number,
            columns.type LIKE '%CHAR%' OR columns.type LIKE '%TEXT%' AS is_text
        FROM main.sqlite_master AS tables LEFT JOIN pragma_table_info(tables.name) AS columns ON columns.pk > 0
        WHERE tables.type = 'table' ORDER BY tables.name, columns.pk"""
    triggers = "SELECT tbl_name, name, sql FROM main.sqlite_master WHERE type = 'trigger'"

    def wanted(self, table: str, key: Key) -> dict[str, str]:
        """Return what makes a table's triggers, by their names."""
        columns = ", ".join(("token", "table_name", *KEYS[: len(key)]))
        name = table.replace("'", "''")

        def note(side: str) -> str:
            parts = "".join(f", {side}.{_quoted(part.name)}" for part in key)
            return f"INSERT INTO {TABLE} ({columns}) SELECT random(), '{name}'{parts}"

        moved = " OR ".join(f"OLD.{_quoted(part.name)} IS NOT NEW.{_quoted(part.name)}" for part in key)
        bodies = {
            "insert": f"{note('NEW')};",
            "update": f"{note('OLD')};" + (f" {note('NEW')} WHERE {moved};" if moved else ""),
            "delete": f"{note('OLD')};",
        }
        return {
            f"irtwin_noted_{table}_{what}": f"CREATE TRIGGER {_quoted(f'irtwin_noted_{table}_{what}')} "
            f"AFTER {what.upper()} ON {_quoted(table)} BEGIN {body} END"
            for what, body in bodies.items()
        }

    def stands(self, made: str, found: str) -> bool:
        """Whether a trigger that was found is what this makes."""
        return made == found


class _Postgresql:
    """A trigger a statement, for each kind, whatever role writes. They call one function, with the parts of the key."""

    # With the definer's rights and path, so that whoever may write a table can. `changed`: a statement's rows.
    body = f"""
DECLARE fresh bigint := (random() * 1e15)::bigint;
BEGIN
    IF TG_OP <> 'TRUNCATE' THEN
        IF NOT EXISTS (SELECT FROM changed) THEN
            RETURN NULL;
        ELSIF TG_NARGS > 0 AND (SELECT count(*) FROM changed) <= {_MOST_OF_STATEMENT} THEN
            INSERT INTO {TABLE} (token, transaction, table_name, {", ".join(KEYS)})
            SELECT fresh, txid_current(), TG_TABLE_NAME,
                noted ->> TG_ARGV[0], noted ->> TG_ARGV[1], noted ->> TG_ARGV[2], noted ->> TG_ARGV[3]
            FROM (SELECT to_jsonb(changed) AS noted FROM changed) AS rows;
            RETURN NULL;
        END IF;
    END IF;
    INSERT INTO {TABLE} (token, transaction, table_name) VALUES (fresh, txid_current(), TG_TABLE_NAME);
    RETURN NULL;
END """
    make = (
        f"""CREATE TABLE {TABLE} (number BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY, token BIGINT NOT NULL,
            transaction BIGINT NOT NULL, table_name TEXT NOT NULL, key_1 TEXT, key_2 TEXT, key_3 TEXT, key_4 TEXT)""",
        f"INSERT INTO {TABLE} (token, transaction, table_name) VALUES ((random() * 1e15)::bigint, txid_current(), '')",
    )
    prepare = f"""DO $make$ BEGIN EXECUTE format('CREATE OR REPLACE FUNCTION {_FUNCTION}() RETURNS trigger
        LANGUAGE plpgsql SECURITY DEFINER SET search_path = %I, pg_temp AS %L', current_schema(), $body${body}$body$);
        END $make$"""
    # Triggers that were off for a while, columns of another type, another server and one put back show here.
    history = f"""
        SELECT concat_ws(' ', (SELECT system_identifier FROM pg_control_system()),
            (SELECT timeline_id FROM pg_control_checkpoint()), current_database(), current_schema(), md5(string_agg(
                concat_ws(' ', triggers.oid, triggers.xmin, tables.oid, tables.xmin, relfilenode, pg_proc.xmin), ','
                ORDER BY triggers.oid)))
        FROM pg_trigger AS triggers JOIN pg_class AS tables ON tables.oid = tgrelid JOIN pg_proc ON pg_proc.oid = tgfoid
        WHERE proname = '{_FUNCTION}'"""
    # No role can give another's tables triggers.
    own = """
        SELECT relname FROM pg_class WHERE relkind = 'r' AND relnamespace = current_schema()::regnamespace
            AND pg_has_role(relowner, 'USAGE')"""
    # Triggers that did so would stand in the way of each other. By transactions: what one noted that has not ended yet
    # stays, whatever its numbers.
    fewer = f"""
        DELETE FROM {TABLE} WHERE (SELECT max(number) - min(number) > {2 * _KEPT} FROM {TABLE})
            AND transaction < (SELECT transaction FROM {TABLE} ORDER BY number DESC OFFSET {_KEPT} LIMIT 1)"""
    # A partition or child is written to without its parent's triggers, so neither is told.
    tables = """
        SELECT tables.relname AS name, columns.attname AS part,
            columns.atttypid IN ('int2'::regtype, 'int4'::regtype, 'int8'::regtype) AS is_number,
            columns.atttypid IN ('text'::regtype, 'varchar'::regtype) AS is_text
        FROM pg_class AS tables
        LEFT JOIN (pg_index CROSS JOIN LATERAL unnest(indkey) WITH ORDINALITY AS parts (number, place))
            ON indrelid = tables.oid AND indisprimary
        LEFT JOIN pg_attribute AS columns ON columns.attrelid = tables.oid AND columns.attnum = parts.number
        WHERE tables.relkind = 'r' AND tables.relnamespace = current_schema()::regnamespace
            AND NOT tables.relhassubclass AND tables.oid NOT IN (SELECT inhrelid FROM pg_inherits)
            AND NOT tables.relrowsecurity
        ORDER BY tables.relname, parts.place"""
    triggers = f"""
        SELECT tables.relname, tgname, encode(tgargs, 'escape')
        FROM pg_trigger JOIN pg_class AS tables ON tables.oid = tgrelid JOIN pg_proc ON pg_proc.oid = tgfoid
        WHERE proname = '{_FUNCTION}' AND tgenabled = 'A' AND prosrc = $body${body}$body$
            AND pronamespace = tables.relnamespace AND tables.relnamespace = current_schema()::regnamespace
            AND (SELECT has_table_privilege(notes.oid, 'SELECT') FROM pg_class AS notes
                WHERE notes.relname = '{TABLE}' AND notes.relnamespace = tables.relnamespace)"""

    def wanted(self, table: str, key: Key) -> dict[str, str]:
        """Return what makes a table's triggers, by their names."""
        of = _quoted(table)
        events = {
            "insert": f"INSERT ON {of} REFERENCING NEW TABLE AS changed",
            "update_from": f"UPDATE ON {of} REFERENCING OLD TABLE AS changed",
            "update_to": f"UPDATE ON {of} REFERENCING NEW TABLE AS changed",
            "delete": f"DELETE ON {of} REFERENCING OLD TABLE AS changed",
            "truncate": f"TRUNCATE ON {of}",
        }
        arguments = ", ".join("'" + part.name.replace("'", "''") + "'" for part in key)
        return {
            name: f"CREATE TRIGGER {name} AFTER {event} FOR EACH STATEMENT EXECUTE FUNCTION {_FUNCTION}({arguments}); "
            f"ALTER TABLE {of} ENABLE ALWAYS TRIGGER {name}"
            for name, event in ((f"irtwin_noted_{what}", event) for what, event in events.items())
        }

    def stands(self, made: str, found: str) -> bool:
        """Whether a trigger that was found is what this makes."""
        arguments = ", ".join("'" + part.replace("'", "''") + "'" for part in found.split("\\000")[:-1])
        return f" {_FUNCTION}({arguments});" in made


_DIALECTS: dict[str, _Sqlite | _Postgresql] = {"sqlite": _Sqlite(), "postgresql": _Postgresql()}


def noted_tables(connection: Connection) -> dict[str, Key]:
    """Return the tables whose changes are all noted, with the keys that notes name.

    None where the role may not read the notes, and in databases other than SQLite and PostgreSQL.
    """
    dialect = _DIALECTS.get(connection.dialect.name)
    if dialect is None:
        return {}
    keys = _keys(connection, dialect)
    if TABLE not in keys:
        return {}
    lacking = {table for table, _, _ in _lacking(connection, dialect, keys)}
    return {table: key for table, key in keys.items() if table not in lacking}


def history(connection: Connection) -> str:
    """Return what changes whenever rows may have changed without a note, beside the version of SQLite's schema."""
    dialect = _DIALECTS.get(connection.dialect.name)
    return "" if dialect is None else str(connection.exec_driver_sql(dialect.history).scalar())


def keep_notes(engine: Engine, tables: Collection[str]) -> None:
    """Have changes of these tables noted from now on, also of those that are new or were made anew; drop old notes.

    Tables that are another role's stay as they are: whoever maps them reads them whole.
    """
    dialect = _DIALECTS.get(engine.dialect.name)
    if dialect is None:
        return
    with engine.connect() as connection:
        keys = _keys(connection, dialect)
        own = keys.keys() & set(connection.exec_driver_sql(dialect.own).scalars())
        wanted = own & set(tables)
        is_lacking = TABLE not in keys or _lacking(connection, dialect, {table: keys[table] for table in wanted})
    if wanted and is_lacking:
        with writing(engine) as session:
            _make(session.connection(), dialect, wanted)
    elif dialect.fewer and TABLE in own:
        with engine.begin() as connection:
            connection.exec_driver_sql(dialect.fewer)


def _make(connection: Connection, dialect: _Sqlite | _Postgresql, tables: Collection[str]) -> None:
    keys = _keys(connection, dialect)
    if TABLE not in keys:
        for sql in dialect.make:
            connection.exec_driver_sql(sql)
    if dialect.prepare:
        connection.exec_driver_sql(dialect.prepare, execution_options={"no_parameters": True})
    sqlite = connection.dialect.name == "sqlite"
    for table, trigger, sql in _lacking(connection, dialect, {table: keys[table] for table in tables}):
        on = "" if sqlite else f" ON {_quoted(table)}"
        connection.exec_driver_sql(f"DROP TRIGGER IF EXISTS {_quoted(trigger)}{on}")
        connection.exec_driver_sql(sql)


def _lacking(
    connection: Connection, dialect: _Sqlite | _Postgresql, keys: dict[str, Key]
) -> list[tuple[str, str, str]]:
    """Return table, name and SQL of each trigger that is not there, or is another one."""
    there = {(table, name): text for table, name, text in connection.exec_driver_sql(dialect.triggers)}
    return [
        (table, name, sql)
        for table, key in keys.items()
        for name, sql in dialect.wanted(table, key).items()
        if (table, name) not in there or not dialect.stands(sql, there[table, name])
    ]


def _keys(connection: Connection, dialect: _Sqlite | _Postgresql) -> dict[str, Key]:
    """Return the tables that there are, with the keys that tell their rows where notes have room for them."""
    keys: dict[str, Key] = {}
    unfit = set()
    for table, part, is_number, is_text in connection.exec_driver_sql(dialect.tables):
        keys[table] = (*keys.get(table, ()), *([] if part is None else [KeyColumn(part, bool(is_number))]))
        if part is not None and not (is_number or is_text):
            unfit.add(table)
    return {table: () if table in unfit or len(key) > len(KEYS) else key for table, key in keys.items()}


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'
