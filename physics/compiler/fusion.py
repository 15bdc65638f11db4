"""Fuses products with the sums that they go into, before LLVM copies any code.

A fused multiply-add rounds once, so it is faster and more accurate than a product and a sum. LLVM
can choose which products to fuse itself (the flag `contract`), but it chooses when it emits machine
code, after loops were unrolled and functions inlined, and not alike in every copy: of a loop over
16 lanes, unrolled into four vectors, the last one had fused other products. The result of a world
then depended on its lane in the last bit. Fused here, in the text that numba gives to LLVM, every
copy fuses the same products, with any vector length.
"""

import re
from collections import Counter

_VALUE = r'%"[^"]+"|%[-\w.$]+|0x[0-9A-Fa-f]+|-?[\d.]+(?:e[-+]?\d+)?'
_NAME = re.compile(r'%"[^"]+"|%[-\w.$]+')
_OPERATION = re.compile(
    rf"^  (?P<result>%\S+) = f(?P<name>mul|add|sub) double (?P<a>{_VALUE}), (?P<b>{_VALUE})$"
)
_DECLARATION = "declare double @llvm.fmuladd.f64(double, double, double)"


def fuse_products(text: str) -> str:
    """LLVM IR in which sums and differences of a product are fused multiply-adds.

    A product is fused if nothing else reads it; of two products, the left one.
    """
    fused, lines = False, []
    for part in re.split(r"(?m)^(?=define )", text):
        body, any_fused = _fuse_function(part) if part.startswith("define ") else (part, False)
        fused |= any_fused
        lines.append(body)
    whole = "".join(lines)
    return f"{whole}\n{_DECLARATION}\n" if fused and _DECLARATION not in whole else whole


def _fuse_function(text: str) -> tuple[str, bool]:
    lines = text.split("\n")
    found = [_OPERATION.match(line) for line in lines]
    products = {m["result"]: n for n, m in enumerate(found) if m and m["name"] == "mul"}
    if not products:
        return text, False
    reads = Counter(_NAME.findall(text))  # one more than what reads it
    fused: set[int] = set()
    for n, operation in enumerate(found):
        if not operation or operation["name"] == "mul":
            continue
        ends = (operation["a"], operation["b"])
        for which, value in enumerate(ends):
            if value not in products or reads[value] != 2:
                continue
            product = found[products[value]]
            assert product is not None
            a, b, other = product["a"], product["b"], ends[1 - which]
            minus = f'{operation["result"][:-1]}.minus"'
            before = ""
            if operation["name"] == "sub":
                turned = a if which == 1 else other
                before = f"  {minus} = fneg double {turned}\n"
                a, other = (minus, other) if which == 1 else (a, minus)
            lines[n] = (
                f"{before}  {operation['result']} = call double @llvm.fmuladd.f64("
                f"double {a}, double {b}, double {other})"
            )
            fused.add(products[value])
            break
    return "\n".join(line for n, line in enumerate(lines) if n not in fused), bool(fused)
