# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors
#
# What docs/Doxyfile reads the headers through: the plain comments of the house style become
# Doxygen's. A comment on a line of its own belongs to what follows, one behind code to that code.

# The licence lines document nothing.
/^\/\/ SPDX-License-Identifier:/d
/^\/\/ Copyright the mono3d authors/d
# A closing brace's "// namespace mono3d" neither.
s_^}[ ]*// namespace.*_}_
# The second line of a comment behind code stands far to the right.
s_^\( \{12,\}\)//\([^/!]\|$\)_\1///<\2_
s_^\( *\)//\([^/!]\|$\)_\1///\2_
s_^\([^/]*[^ :/"].*[;,{})]\)[ ]*// \(.*\)$_\1 ///< \2_
# Words in angle brackets are not HTML.
\_///_ s_<\([A-Za-z][A-Za-z ._-]*\)>_\\<\1\\>_g
