from rooms import written

PAGE = """7 in 1 files, 9 in 2 files before

| `gap` | 1 | those |
| `knowledge`, else | 1,000 | these |
| `knowledge/store`, `storage` | 5 | all |
| jobs at the top | 0 | nobody |
"""


def test_a_file_counts_in_the_row_of_its_innermost_folder():
    lines = {"gap/a.py": 1200, "knowledge/b.py": 2, "knowledge/store/c.py": 3, "storage/d.py": 4, "workflow.py": 5}
    assert written(PAGE, lines).splitlines() == [
        "1,214 in 5 files, 9 in 2 files before",
        "",
        "| `gap` | 1,200 | those |",
        "| `knowledge`, else | 2 | these |",
        "| `knowledge/store`, `storage` | 7 | all |",
        "| jobs at the top | 5 | nobody |",
    ]
