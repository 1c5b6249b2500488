from tramnet_master.experiments.paper_cases import paper_cases


def test_the_cases_are_those_of_table_2():
    rows = [
        (case.number, case.segments, case.criteria, case.motion_time_s, case.best_generation)
        for case in paper_cases().cases
    ]

    assert rows == [
        (1, 16, "T v", 0.431, 70),
        (2, 16, "T", 0.375, 255),
        (3, 16, "τ v", 0.502, 248),
        (4, 16, "τ", 0.307, 220),
        (5, 16, "T τ v", 0.873, 280),
        (6, 16, "T τ", 0.367, 285),
        (7, 25, "T v", 0.421, 40_000),
    ]


def test_only_case_7_runs_longer():
    cases = paper_cases()

    assert {cases.generations_of(case) for case in cases.cases[:6]} == {300}
    assert cases.generations_of(cases.find(7)) == 50_000
