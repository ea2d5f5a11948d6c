-- Jobs may be evolutions. SQLite changes no CHECK but in the text of the table; what is stored meets the wider one.
PRAGMA writable_schema = ON;
UPDATE sqlite_schema SET sql = replace(sql, '(''case'', ''rows'')', '(''case'', ''rows'', ''evolution'')') WHERE type = 'table' AND name = 'jobs';
PRAGMA writable_schema = RESET;
